"""What eyes and policies are called in tables and figures."""

from hrc_env.experiments.impact.trial.eyes import LEFT_FROM_S, eyes_called


def eyes_words(name: str) -> str:
    """Eyes as people read them."""
    eyes = eyes_called(name)
    if eyes.perception not in ("keypoints", "pixels"):
        return eyes.perception
    cameras = f"{eyes.n_cameras} camera{'s' if eyes.n_cameras > 1 else ''}"
    words = [eyes.estimator, cameras]
    if eyes.perception == "pixels":
        words.insert(0, "pixels")
    if eyes.is_alone:
        words.append("from the start")
    elif eyes.n_cameras < 4:
        words[-1] += f" after {LEFT_FROM_S:g} s"
    if eyes.latency_s:
        told = "" if eyes.is_told else ", not told"
        words.append(f"{1000 * eyes.latency_s:.0f} ms late{told}")
    return ", ".join(words)
