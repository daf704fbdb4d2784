"""Pixels to keypoints: crops of every camera through BlazePose, two at a time.

The calling thread draws crops while two others run the networks on them. Each of these has its own
interpreters: what is seen does not depend on who came first.
"""

import functools
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

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
from hrc_env.perception.believing import is_somebody
from hrc_env.perception.exposure import Developed, develop
from hrc_env.perception.noise import ERROR, STANDING, sigma_px
from hrc_env.perception.searching import (
    STATURE_OF_SIDE,
    Candidates,
    ImageSource,
    Views,
    apart_from,
    distinct,
    image_crop,
    people,
    proposals,
    search_jobs,
    search_windows,
)
from hrc_env.perception.weights import fetch_weights

SIDE = network.LANDMARK_SIDE
ResultT = TypeVar("ResultT")
_THREAD = threading.local()
"""Its `networks`: those of one of a detector's two threads."""
KeypointFunction = Callable[[Image], Floats | None]
"""A crop (256, 256, 3) RGB uint8 -> (J, 3): x, y [px] from its corner and confidence in [0, 1] of
`core.skeleton.JOINTS`; NaN, NaN, 0 of a joint that was not found. None: nobody is there."""
DETECTORS: Registry[Callable[[], KeypointFunction] | None] = Registry(
    "detector", {"blazepose": None}
)
"""By name: what makes the function, once for every thread that calls it."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class DetectorConfig:
    """Which networks find people, and what is believed of them."""

    min_presence: float = 0.5
    """Landmarks are believed from this person flag on [0..1]; MediaPipe's own default."""
    sure_presence: float = 0.9
    """Below this flag [0..1] the detector stage is asked as well."""
    gate_every: int = 25
    """The detector stage is also asked once in so many looks: a second at 25 Hz."""
    max_offset: float = 0.25
    """Hips further from the window's middle, as a share of its side, are somebody else's."""
    outside_confidence: float = 0.1
    """Joints that the network places outside the image are guesses: at most this visible."""
    search_every: int = 5
    """A camera whose whole image was searched for nobody is searched again so many steps later."""
    runtime: str = "litert"
    """What the networks run on: "litert", "openvino" (an extra, faster) or "auto"."""
    network: str = "full"
    """The landmark network: "lite", "full" or "heavy"; all but "full" are fetched once with
    `python -m hrc_env setup --networks lite heavy`."""
    keypoints: str = "blazepose"
    """What finds joints in crops: BlazePose's landmark network, or another function that was
    registered (`hrc_env.register_detector`); people are always searched for by BlazePose."""
    folded: str = "full"
    """The landmark network for who is bent, squats or kneels; "heavy" is more exact, and slower."""

    def __post_init__(self) -> None:
        check_names("detector.runtime", [self.runtime], network.RUNTIMES)
        check_names("detector.keypoints", [self.keypoints], DETECTORS)
        check_names("detector.network", [self.network], network.NETWORKS)
        check_names("detector.folded", [self.folded], network.NETWORKS)
        check_fields(self, "be in (0, 1]", "min_presence", "sure_presence", "outside_confidence")
        check_fields(self, "be positive", "gate_every", "search_every", "max_offset")

    @property
    def weights(self) -> tuple[str, ...]:
        """The names of the weights that these networks need."""
        landmark = dict.fromkeys((self.network, self.folded))
        return ("pose_detection", *(f"pose_landmark_{name}" for name in landmark))


@dataclass(frozen=True, slots=True)
class Detection:
    """One worker as all cameras see them; a camera without them is NaN, 0 and infinite."""

    px: Points2  # (C, J, 2) [px] in the whole image, as its lens distorts it
    confidence: Floats  # (C, J) visibility in [0, 1]
    sigma_px: Floats  # (C, J) standard deviation of each coordinate [px]
    windows: Views  # where each camera looked
    crops: list[Image | None] = field(default_factory=list)  # what the network was given of each


@dataclass(frozen=True, slots=True)
class _Networks:
    """One thread's interpreters."""

    detect: network.PersonDetector
    landmark: dict[str, network.Landmarker]  # by name
    own: KeypointFunction | None  # what finds joints instead of these


class PoseDetector(Stateful):
    """Finds the joints of workers in the images of a rig; networks and their threads are made at
    the first look and left out of a pickle."""

    CHANGES = ("_looks",)

    def __init__(
        self,
        cameras: Sequence[PinholeCamera],
        config: DetectorConfig | None = None,
        floor_world: Points3 | None = None,
        error: Floats = ERROR,
    ) -> None:
        """`floor_world` (N, 3) [m], `error`: as of `pipeline.looking.Looking`.
        Raises `WeightsError` where the weights cannot be had, `ConfigError` without the runtime."""
        self.cameras = tuple(cameras)
        self.config = config or DetectorConfig()
        fetch_weights(self.config.weights)
        network.chosen_runtime(self.config.runtime)
        self.floor_world, self.error = floor_world, error
        self._search = [search_windows(camera, floor_world) for camera in self.cameras]
        self.blank: frozenset[int] = frozenset()
        """Cameras whose images were blank in the last search: dark, white, of one colour, noise."""
        self._looks: dict[int, list[int]] = {}
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
        """Look for one worker through a window a camera; search if there is no window at all.

        Args:
            source: gives crops of the cameras' present images.
            windows: (C,) where to look; None where this camera need not.
            track: who is followed: a number of the worker's own.
            others: windows (C,) of other workers; a search does not find these again.
            found: what `search` found in these very images, if it was asked already.
            folded, posture: what is expected of the worker (`outline.is_folded`, `posture_of`).
        """
        check_shape("windows", (len(windows),), (len(self.cameras),), "one a camera")
        if any(windows):
            return self._look(source, windows, track, folded, posture)
        known = self.search(source) if found is None else found
        for proposal in proposals(apart_from(known, others), self.cameras):
            self.forget(track)
            sight = self._look(source, proposal, track, folded, posture)
            joints = sight.px, sight.confidence, sight.sigma_px
            if is_somebody(*joints, self.cameras, self.floor_world):
                return sight
        self.forget(track)
        return _nobody([None] * len(windows))

    def search(self, source: ImageSource, which: Sequence[int] | None = None) -> list[list[Roi]]:
        """Regions of interest of the people in whole images of cameras `which` (None: all), best
        first; empty for the others. Both networks are sure of them."""
        which = range(len(self.cameras)) if which is None else which
        jobs = search_jobs(source, self._search, which)
        done = self._share(lambda nets, job=job: job(nets.detect) for job in jobs)
        people = distinct([one for some in done for one in some.found], len(self.cameras))
        showing = {some.camera for some in done if some.shows}
        self.blank = frozenset(which) - showing
        asked = [(c, window) for c, windows in enumerate(people) for window in windows]
        sure = replace(self.config, min_presence=self.config.sure_presence)
        joints_of = self._share(
            functools.partial(_joints, self._crop(source, *one).picture, one[1], True, False, sure)
            for one in asked
        )
        known = [one for one, joints in zip(asked, joints_of, strict=True) if joints is not None]
        return [[window for k, window in known if k == c] for c in range(len(self.cameras))]

    def forget(self, track: int) -> None:
        """Treat this track as new: the detector stage is asked at its next look."""
        self._looks.pop(track, None)

    def borrow_networks(self, lender: "PoseDetector") -> None:
        """Run the networks on the threads of another detector of the same settings, which closes
        them."""
        if lender.config != self.config:
            raise ConfigError("A detector borrows networks from one of the same settings.")
        self._lender = lender

    def close(self) -> None:
        """Stop the threads and free their networks; the next look makes them anew."""
        if self._threads is not None:
            self._threads.shutdown(wait=True, cancel_futures=True)
        self._threads = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_threads": None}

    def _look(
        self,
        source: ImageSource,
        windows: Sequence[Roi | None],
        track: int,
        folded: bool,
        posture: Sequence[float],
    ) -> Detection:
        """One worker's joints in these windows."""
        looks = self._looks.setdefault(track, [0] * len(self.cameras))
        used = [(c, window) for c, window in enumerate(windows) if window is not None]
        sight, doubts = _nobody(windows), [1.0] * len(windows)

        def job(c: int, window: Roi) -> Callable[[_Networks], Floats | None]:
            crop, doubts[c], _ = self._crop(source, c, window)
            sight.crops[c] = crop
            ask = self._is_turn(looks[c], c)
            return functools.partial(_joints, crop, window, ask, folded, self.config)

        joints_of = self._share(job(c, window) for c, window in used)  # drawn one after the other
        before, looks[:] = list(looks), [0] * len(looks)  # 0: the detector stage is asked next
        for (c, window), joints in zip(used, joints_of, strict=True):
            if joints is not None:
                looks[c] = before[c] + 1
                self._write(sight, c, window, joints, posture)
                sight.sigma_px[c] *= doubts[c]
        return sight

    def _crop(self, source: ImageSource, c: int, window: Roi) -> Developed:
        """Return a developed copy of the crop, black outside of the camera's image: renderers go on
        drawing."""
        crop, camera = image_crop(source, c, window), self.cameras[c]
        mask = _frame_mask(window, camera.width_px, camera.height_px)
        developed = develop(crop, mask)
        picture = np.array(developed.picture)
        if mask is not None:
            picture = np.asarray(cv2.bitwise_and(picture, picture, mask=mask), np.uint8)
        return developed._replace(picture=picture)

    def _is_turn(self, looks: int, camera: int) -> bool:
        """Whether the detector stage is due; the cameras take turns to spread its cost."""
        every = self.config.gate_every
        return looks == 0 or (looks + camera * every // len(self.cameras)) % every == 0

    def _share(self, jobs: Iterable[Callable[[_Networks], ResultT]]) -> list[ResultT]:
        """Results in order."""
        threads = self._started()
        given: list[Callable[[], ResultT]] = []
        for job in jobs:
            try:
                given.append(threads.submit(self._done, job).result)
            except RuntimeError:  # the interpreter is ending, and its threads take no more work
                given.append(functools.partial(self._done, job))
        return [result() for result in given]

    def _started(self) -> ThreadPoolExecutor:
        """The threads, started if need be; a lender's if there is one."""
        if self._lender is not None:
            return self._lender._started()
        if self._threads is None:
            self._threads = ThreadPoolExecutor(2, thread_name_prefix="hrc_env-detector")
        return self._threads

    def _done(self, job: Callable[[_Networks], ResultT]) -> ResultT:
        """What a job gives with this thread's networks."""
        if not hasattr(_THREAD, "networks"):
            _THREAD.networks = _networks(self.config)
        return job(_THREAD.networks)

    def _write(
        self, sight: Detection, c: int, window: Roi, joints: Floats, posture: Sequence[float]
    ) -> None:
        outside = ~inside_image(self.cameras[c], joints[:, :2])
        confidence = joints[:, 2].copy()
        confidence[outside] = np.minimum(confidence[outside], self.config.outside_confidence)
        sight.px[c], sight.confidence[c] = joints[:, :2], confidence
        stature_px = STATURE_OF_SIDE * window.side_px
        sight.sigma_px[c] = sigma_px(confidence, stature_px, posture, self.error)


def _nobody(windows: Sequence[Roi | None]) -> Detection:
    shape = (len(windows), N_JOINTS)
    nothing = np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf)
    return Detection(*nothing, list(windows), [None] * len(windows))


def _networks(config: DetectorConfig) -> _Networks:
    names, runtime = {config.network, config.folded}, config.runtime
    landmark = {name: network.load_landmarker(name, runtime) for name in names}
    make = DETECTORS[config.keypoints]
    return _Networks(network.load_person_detector(runtime), landmark, make and make())


def own_joints(find: KeypointFunction, crop: Image, window: Roi) -> Floats | None:
    """(J, 3) pixels and confidence, or None, by somebody's function; refuses what is neither."""
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


def _joints(
    crop: Image, window: Roi, ask: bool, folded: bool, config: DetectorConfig, nets: _Networks
) -> Floats | None:
    """(J, 3) pixels and visibility, or None where there is no worker; `ask` the detector stage?"""
    if nets.own is not None:
        return own_joints(nets.own, crop, window)
    landmark = nets.landmark[config.folded if folded else config.network]
    points, presence, heat = landmark(blazepose.landmark_input(crop))
    if presence < config.min_presence:
        return None
    if ask or presence < config.sure_presence:
        offsets = [np.hypot(*(person.hip - 0.5)) for person in people(nets.detect, crop)]
        if min(offsets, default=np.inf) > config.max_offset:
            return None
    joints = blazepose.decode_landmarks(points, heat)[BLAZEPOSE_INDEX]
    joints[:, :2] = blazepose.to_image(joints[:, :2], window)
    return joints


@functools.lru_cache(maxsize=64)
def _frame_mask(window: Roi, width_px: int, height_px: int) -> NDArray[np.uint8] | None:
    """Which pixels of a crop are in the image, not 0; None for all. Windows are steady."""
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
