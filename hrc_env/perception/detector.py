"""Detection of keypoints by BlazePose in crops of all cameras' images, two crops at a time.

The calling thread renders crops while two other threads run the networks on them. Each of these
threads has separate interpreters, so that results do not depend on the order of processing.
"""

import functools
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeAlias, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import Stateful
from hrc_env.core.errors import ConfigError, check_fields, check_names, check_shape
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.records import Roi
from hrc_env.core.registry import Registry
from hrc_env.core.skeleton import BLAZEPOSE_INDEX, N_JOINTS
from hrc_env.core.typing import Floats, Image, Points2, Points3
from hrc_env.geometry.cameras import PinholeCamera, inside_image
from hrc_env.perception import blazepose, network
from hrc_env.perception.exposure import Developed, develop
from hrc_env.perception.noise import ERROR, sigma_px
from hrc_env.perception.outline import STANDING
from hrc_env.perception.plausibility import is_person
from hrc_env.perception.searching import (
    STATURE_OF_SIDE,
    Candidates,
    ImageSource,
    Views,
    crop_image,
    drop_duplicates,
    exclude_people,
    find_people,
    propose_people,
    search_jobs,
    search_windows,
)
from hrc_env.perception.weights import fetch_weights

SIDE = network.LANDMARK_SIDE
"""Side of the crops [px]."""
ResultT = TypeVar("ResultT")
_THREAD = threading.local()
"""Thread-local storage, which contains the `networks` of a detector's thread."""
KeypointFunction: TypeAlias = Callable[[Image], Floats | None]
"""Function from a crop (256, 256, 3), RGB of uint8, to (J, 3): x, y [px] from the crop's corner and
confidence in [0, 1] of `core.skeleton.JOINTS`. The row of a joint that is not found is NaN, NaN, 0.
The result is None if there is no person."""
DETECTORS: Registry[Callable[[], KeypointFunction] | None] = Registry(
    "detector", {"blazepose": None}
)
"""Factories of keypoint functions, by name. Each thread that detects keypoints calls the selected
factory once."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class DetectorConfig:
    """Settings of the detector: its networks and the thresholds of detections."""

    RENAMED: ClassVar[Mapping[str, str]] = {
        "gate_every": "check_every",
        "sure_presence": "check_presence",
        "folded": "folded_network",
        "max_offset": "max_hip_offset",
    }
    """Current names of renamed fields, by their old names."""

    min_presence: float = 0.5
    """Minimum presence score [0..1] at which landmarks are accepted; the default is that of
    MediaPipe."""
    check_presence: float = 0.9
    """Presence score [0..1] below which a detection is verified by the detector stage."""
    check_every: int = 25
    """Interval, in detections, at which a detection is verified by the detector stage even if its
    presence score is high; 25 means once per second at 25 Hz."""
    max_hip_offset: float = 0.25
    """Maximum distance of the hips from the centre of the window, as a fraction of its side. Hips
    farther away are attributed to another person."""
    outside_confidence: float = 0.1
    """Maximum confidence of joints that the network locates outside the image, because these
    positions are extrapolated."""
    every: int = 1
    """Number of steps from one image that a camera uses to the next; the intervals below are then
    longer, too. All images are used while a worker is not tracked and may be present, or while the
    measurements disagree with the estimate. The emulator of `perception="keypoints"` leaves out
    images by the same rule."""
    in_turns: bool = False
    """Whether the cameras use images in turns, 1 / `every` of them in each step, instead of all in
    the same step."""
    search_every: int = 5
    """Number of steps between searches of a camera's whole image while no person is found in it."""
    runtime: str = "litert"
    """Runtime of the networks: "litert", "openvino" (faster, an optional extra) or "auto" (OpenVINO
    if it is installed)."""
    network: str = "full"
    """Landmark network: "lite", "full" or "heavy"; "lite" and "heavy" must be fetched once with
    `python -m hrc_env setup --networks lite heavy`."""
    keypoints: str = "blazepose"
    """Function that finds joints in crops: "blazepose" for BlazePose's landmark network, or the
    name of a registered function (`hrc_env.register_detector`); searches for people always use
    BlazePose."""
    folded_network: str = "full"
    """Landmark network for workers that bend, squat or kneel; "heavy" is more accurate but
    slower."""

    def __post_init__(self) -> None:
        check_names("detector.runtime", [self.runtime], network.RUNTIMES)
        check_names("detector.keypoints", [self.keypoints], DETECTORS)
        check_names("detector.network", [self.network], network.NETWORKS)
        check_names("detector.folded_network", [self.folded_network], network.NETWORKS)
        check_fields(self, "be in (0, 1]", "min_presence", "check_presence", "outside_confidence")
        check_fields(self, "be positive", "check_every", "every", "search_every", "max_hip_offset")

    @property
    def weights(self) -> tuple[str, ...]:
        """Names of the weights files of the selected networks."""
        landmark = dict.fromkeys((self.network, self.folded_network))
        return ("pose_detection", *(f"pose_landmark_{name}" for name in landmark))


@dataclass(frozen=True, slots=True)
class Detection:
    """Detection of a worker in the images of all cameras.

    For cameras that do not show the worker, pixels are NaN, confidences 0 and standard deviations
    infinite.
    """

    px: Points2
    """(C, J, 2) joints in pixels of the whole image, including lens distortion [px]."""
    confidence: Floats
    """(C, J) visibilities in [0, 1]."""
    sigma_px: Floats
    """(C, J) standard deviation of each coordinate [px]."""
    windows: Views
    """(C,) window of each camera's image in which the worker was detected or searched for."""
    crops: list[Image | None] = field(default_factory=list)
    """(C,) crop of each window, as it was passed to the network."""


@dataclass(frozen=True, slots=True)
class _Networks:
    """The networks of one thread."""

    detect: network.PersonDetector
    """Detector stage, which locates people."""
    landmark: dict[str, network.Landmarker]
    """Landmark stages, which locate joints, by the network's name."""
    registered: KeypointFunction | None
    """Registered function that replaces the landmark stages, or None."""


class PoseDetector(Stateful):
    """A detector of the joints of workers in the images of a rig.

    The networks and their threads are created by the first detection and are not pickled.

    Args:
        cameras: the rig.
        config: settings; None for the defaults.
        floor_world: (N, 3) points of the floor where people may stand [m]; None if unknown.
        error: table `sigma` of a calibration, which gives the reported standard deviations.

    Raises:
        WeightsError: the networks' weights are missing and cannot be fetched.
        ConfigError: the runtime is not installed.
    """

    CHANGES = ("_counts",)

    def __init__(
        self,
        cameras: Sequence[PinholeCamera],
        config: DetectorConfig | None = None,
        floor_world: Points3 | None = None,
        error: Floats = ERROR,
    ) -> None:
        self.cameras = tuple(cameras)
        self.config = config or DetectorConfig()
        fetch_weights(self.config.weights)
        network.resolve_runtime(self.config.runtime)
        self.floor_world, self.error = floor_world, error
        self._search = [search_windows(camera, floor_world) for camera in self.cameras]
        self.blank: frozenset[int] = frozenset()
        """Indices of the cameras with a blank image (uniform or only noise) in the last search."""
        self._counts: dict[int, list[int]] = {}
        """Numbers of consecutive detections in each camera, by track; 0 if the next detection must
        be verified."""
        self._threads: ThreadPoolExecutor | None = None
        self._lender: PoseDetector | None = None

    def detect(
        self,
        source: ImageSource,
        windows: Sequence[Roi | None],
        track: int = 0,
        others: Sequence[Sequence[Roi | None]] = (),
        found: Candidates | None = None,
        folded: bool = False,
        posture: Sequence[float] = STANDING,
    ) -> Detection:
        """Detect a worker in one window per camera, or by a search if there are no windows.

        Args:
            source: the present images of the cameras.
            windows: (C,) windows of the worker; None for cameras without one.
            track: number of the worker's track.
            others: windows (C,) of other workers, which a search excludes.
            found: result of `search` in these images; None if it was not called.
            folded: whether the worker is expected to bend, squat or kneel (`outline.is_folded`).
            posture: expected posture (`outline.posture_of`).
        """
        check_shape("windows", (len(windows),), (len(self.cameras),), "one entry per camera")
        if any(windows):
            return self._detect_in(source, windows, track, folded, posture)
        known = self.search(source) if found is None else found
        for proposal in propose_people(exclude_people(known, others), self.cameras):
            self.forget(track)
            seen = self._detect_in(source, proposal, track, folded, posture)
            joints = seen.px, seen.confidence, seen.sigma_px
            if is_person(*joints, self.cameras, self.floor_world):
                return seen
        self.forget(track)
        return _no_detection([None] * len(windows))

    def search(self, source: ImageSource, which: Sequence[int] | None = None) -> list[list[Roi]]:
        """Search whole images for people, which both networks must detect with high confidence.

        Args:
            source: the present images of the cameras.
            which: indices of the cameras to search; None for all.

        Returns:
            (C,) windows of the people in each image, best first; empty for cameras that were not
            searched.
        """
        which = range(len(self.cameras)) if which is None else which
        jobs = search_jobs(source, self._search, which)
        done = self._run_jobs(lambda nets, job=job: job(nets.detect) for job in jobs)
        people = drop_duplicates([one for each in done for one in each.found], len(self.cameras))
        self.blank = frozenset(which) - {each.camera for each in done if each.is_usable}
        checked = [(c, window) for c, windows in enumerate(people) for window in windows]
        sure = replace(self.config, min_presence=self.config.check_presence)
        joints_of = self._run_jobs(
            functools.partial(
                _find_joints, self._crop(source, c, window).picture, window, True, False, sure
            )
            for c, window in checked
        )
        known = [one for one, joints in zip(checked, joints_of, strict=True) if joints is not None]
        return [[window for k, window in known if k == c] for c in range(len(self.cameras))]

    def forget(self, track: int) -> None:
        """Forget a track, so that its next detection is verified by the detector stage."""
        self._counts.pop(track, None)

    def borrow_networks(self, lender: "PoseDetector") -> None:
        """Share the threads and networks of another detector with the same settings.

        The other detector remains responsible for closing them.
        """
        if lender.config != self.config:
            raise ConfigError(
                "A detector can share the networks of another detector only if both "
                "have the same settings."
            )
        self._lender = lender

    def close(self) -> None:
        """Stop the threads and free their networks; the next detection creates new ones."""
        if self._threads is not None:
            self._threads.shutdown(wait=True, cancel_futures=True)
        self._threads = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_threads": None}

    def _detect_in(
        self,
        source: ImageSource,
        windows: Sequence[Roi | None],
        track: int,
        folded: bool,
        posture: Sequence[float],
    ) -> Detection:
        """Detect a worker's joints in the given windows (C,); see `detect`."""
        counts = self._counts.setdefault(track, [0] * len(self.cameras))
        used = [(c, window) for c, window in enumerate(windows) if window is not None]
        seen, doubts = _no_detection(windows), [1.0] * len(windows)

        def prepare(c: int, window: Roi) -> Callable[[_Networks], Floats | None]:
            crop, doubts[c], _ = self._crop(source, c, window)
            seen.crops[c] = crop
            check = self._must_check(counts[c], c)
            return functools.partial(_find_joints, crop, window, check, folded, self.config)

        joints_of = self._run_jobs(prepare(c, window) for c, window in used)  # rendered one by one
        before, counts[:] = list(counts), [0] * len(counts)  # 0: the detector stage checks next
        for (c, window), joints in zip(used, joints_of, strict=True):
            if joints is not None:
                counts[c] = before[c] + 1
                self._write(seen, c, window, joints, posture)
                seen.sigma_px[c] *= doubts[c]
        return seen

    def _crop(self, source: ImageSource, c: int, window: Roi) -> Developed:
        """Return a copy of a crop, enhanced by `exposure.develop`.

        A copy is needed because renderers reuse their arrays. It is black outside the camera's
        image.
        """
        crop, camera = crop_image(source, c, window), self.cameras[c]
        mask = _frame_mask(window, camera.width_px, camera.height_px)
        developed = develop(crop, mask)
        picture = np.array(developed.picture)
        if mask is not None:
            picture = np.asarray(cv2.bitwise_and(picture, picture, mask=mask), np.uint8)
        return developed._replace(picture=picture)

    def _must_check(self, count: int, camera: int) -> bool:
        """Return whether the detector stage must verify a detection in a camera.

        Cameras are verified at different steps to distribute the computing time.
        """
        every = self.config.check_every
        return count == 0 or (count + camera * every // len(self.cameras)) % every == 0

    def _run_jobs(self, jobs: Iterable[Callable[[_Networks], ResultT]]) -> list[ResultT]:
        """Run jobs on the threads, and return their results in order."""
        threads = self._get_threads()
        results: list[Callable[[], ResultT]] = []
        for job in jobs:
            try:
                results.append(threads.submit(self._run_job, job).result)
            except RuntimeError:  # the interpreter shuts down, and its threads reject new jobs
                results.append(functools.partial(self._run_job, job))
        return [result() for result in results]

    def _get_threads(self) -> ThreadPoolExecutor:
        """Return the detector's (or the shared) threads, and start them if necessary."""
        if self._lender is not None:
            return self._lender._get_threads()
        if self._threads is None:
            self._threads = ThreadPoolExecutor(2, thread_name_prefix="hrc_env-detector")
        return self._threads

    def _run_job(self, job: Callable[[_Networks], ResultT]) -> ResultT:
        """Run a job with the networks of the current thread, and return its result."""
        if not hasattr(_THREAD, "networks"):
            _THREAD.networks = _make_networks(self.config)
        return job(_THREAD.networks)

    def _write(
        self, seen: Detection, c: int, window: Roi, joints: Floats, posture: Sequence[float]
    ) -> None:
        """Store the joints (J, 3) that were found in a window of camera c in a `Detection`."""
        outside = ~inside_image(self.cameras[c], joints[:, :2])
        confidence = joints[:, 2].copy()
        confidence[outside] = np.minimum(confidence[outside], self.config.outside_confidence)
        seen.px[c], seen.confidence[c] = joints[:, :2], confidence
        stature_px = STATURE_OF_SIDE * window.side_px
        seen.sigma_px[c] = sigma_px(confidence, stature_px, posture, self.error)


def _no_detection(windows: Sequence[Roi | None]) -> Detection:
    """Return a detection without any camera that shows the worker."""
    shape = (len(windows), N_JOINTS)
    nothing = np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf)
    return Detection(*nothing, list(windows), [None] * len(windows))


def _make_networks(config: DetectorConfig) -> _Networks:
    """Load the networks for one thread."""
    names, runtime = {config.network, config.folded_network}, config.runtime
    landmark = {name: network.load_landmarker(name, runtime) for name in names}
    make = DETECTORS[config.keypoints]
    return _Networks(network.load_person_detector(runtime), landmark, make and make())


def call_detector(find: KeypointFunction, crop: Image, window: Roi) -> Floats | None:
    """Return the joints that a registered function finds in a crop.

    Args:
        find: the registered function.
        crop: (256, 256, 3) crop of the window.
        window: window of the image [px].

    Returns:
        (J, 3) pixels of the image and confidences, or None if there is no person.

    Raises:
        ConfigError: the function returns an array of another shape or invalid confidences.
    """
    found = find(crop)
    if found is None:
        return None
    joints = np.array(found, float)
    check_shape("A detector's keypoints", joints.shape, (N_JOINTS, 3), "joints, x y confidence")
    missing = np.isnan(joints[:, :2]).any(1)
    joints[missing] = (np.nan, np.nan, 0.0)
    if not ((joints[:, 2] >= 0) & (joints[:, 2] <= 1)).all():
        raise ConfigError(f"A detector's confidences must be in [0, 1], got {joints[:, 2]}.")
    joints[:, :2] = blazepose.to_image(joints[:, :2] / SIDE, window)
    return joints


def _find_joints(
    crop: Image, window: Roi, check: bool, folded: bool, config: DetectorConfig, nets: _Networks
) -> Floats | None:
    """Return the joints of the person in a crop.

    Args:
        crop: (256, 256, 3) crop of the window.
        window: window of the image [px].
        check: whether the detector stage must verify the person.
        folded: whether the person is expected to bend, squat or kneel.
        config: settings of the detector.
        nets: networks of this thread.

    Returns:
        (J, 3) pixels of the image and visibilities, or None if there is no person.
    """
    if nets.registered is not None:
        return call_detector(nets.registered, crop, window)
    landmark = nets.landmark[config.folded_network if folded else config.network]
    points, presence, heat = landmark(blazepose.landmark_input(crop))
    if presence < config.min_presence:
        return None
    if check or presence < config.check_presence:
        offsets = [np.hypot(*(person.hip - 0.5)) for person in find_people(nets.detect, crop)]
        if min(offsets, default=np.inf) > config.max_hip_offset:
            return None
    joints = blazepose.decode_landmarks(points, heat)[BLAZEPOSE_INDEX]
    joints[:, :2] = blazepose.to_image(joints[:, :2], window)
    return joints


@functools.lru_cache(maxsize=64)
def _frame_mask(window: Roi, width_px: int, height_px: int) -> NDArray[np.uint8] | None:
    """Return a mask (256, 256) of a crop's pixels that are in the image, or None if all are."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    frame = np.array([width_px, height_px])
    square = blazepose.to_image(corners, window)
    if ((square >= 0) & (square < frame)).all():
        return None
    back = cv2.invertAffineTransform(blazepose.image_from_crop(window, SIDE))
    mask = np.zeros((SIDE, SIDE), np.uint8)
    polygon = np.round(corners * frame @ back[:, :2].T + back[:, 2]).astype(np.int32)
    cv2.fillConvexPoly(mask, polygon, 1)
    return mask
