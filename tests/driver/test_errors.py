import pickle

import pytest

import transientcam_driver
from transientcam_driver import DriverError, errors

EXAMPLES: list[DriverError] = [
    errors.SequenceError("takes", 0, "an integer of at least 1"),
    errors.SceneError("a.toml", "light", 3, "a table"),
    errors.EffectError("effects", "rain", "one of ambient"),
    errors.SpecError("webcam", "neither"),
    errors.CalibrationError("anything"),
    errors.CalibrationMismatch("harmonics", 3, 4),
    errors.CalibrationFileError("a.npz", "images", "absent", "float32"),
    errors.CameraNotFound(),
    errors.CameraNotFound("A-1"),
    errors.CameraNotFound("A-1", "it has no ToF sensor"),
    errors.CameraUnreachable("10.10.31.180:50660"),
    errors.ImagesLost("12 bytes are missing"),
    errors.PluginError("lidar", "it is not installed"),
    errors.CompilerMissing("No module named 'numba'"),
    errors.PermissionDenied("/dev/bus/usb/001/002", "RULE"),
    errors.CameraBusy("/dev/bus/usb/001/002"),
    errors.LibusbMissing(),
    errors.CameraLost("unplugged"),
    errors.CameraClosed(),
    errors.NotStreaming("idle"),
    errors.FrameTimeout(1.5),
    errors.CameraFault("the interlock was opened"),
    errors.DeviceRefused("START", "NOT_CONFIGURED", ""),
    errors.TransferStalled(),
    errors.TransferOverflow(),
    errors.ProtocolError("nonsense"),
    errors.FirmwareTooOld(0, 1),
]


@pytest.mark.parametrize("error", EXAMPLES, ids=lambda error: type(error).__name__)
def test_an_error_makes_its_own_sentence_and_survives_a_process_border(error: DriverError) -> None:
    copy = pickle.loads(pickle.dumps(error))

    assert str(copy) == str(error) != ""
    assert vars(copy) == vars(error)
    assert not str(error).startswith("(")  # not a bare tuple of arguments


def test_the_tree_at_the_top_of_the_file_shows_every_class_and_its_parent() -> None:
    classes = {
        name: value
        for name, value in vars(errors).items()
        if isinstance(value, type) and issubclass(value, DriverError)
    }
    assert errors.__doc__ is not None
    drawn: dict[str, int] = {}
    for line in errors.__doc__.splitlines():
        name = next((word for word in line.replace("─", " ").split() if word in classes), None)
        if name is not None and line.startswith("    ") and name not in drawn:
            drawn[name] = line.index(name)
    assert drawn.keys() == classes.keys()
    path: list[str] = []
    for name, depth in drawn.items():
        path = [parent for parent in path if drawn[parent] < depth]
        if path:
            assert classes[name].__base__ is classes[path[-1]]
        path.append(name)


def test_every_example_is_here() -> None:
    tested = {type(error) for error in EXAMPLES}
    missing = [
        name
        for name in transientcam_driver.__all__
        if isinstance(value := getattr(transientcam_driver, name), type)
        and issubclass(value, DriverError)
        and value not in tested
        and not value.__subclasses__()
    ]
    assert missing == []
