"""What transfers of meshes and of motions share: opened weights, and mistakes of the user."""

from . import npt

_opened = {}


def forget():
    _opened.clear()


def opened(weights, options):
    """The transfer of the last options: weights are read once."""
    key = (weights, tuple(sorted(options.items(), key=lambda item: item[0])))
    if key not in _opened:
        _opened.clear()
        _opened[key] = npt.PoseTransfer(weights, **options)
    return _opened[key]


class Mistake(Exception):
    """What the user can put right, in words."""


def expect(context, thing, what, kind, kind_name):
    if thing.type != kind:
        article = "an" if thing.type[0] in "AEIOU" else "a"
        raise Mistake(f"{what} '{thing.name}' is {article} {thing.type.lower()}: pick {kind_name}")
    if thing.name not in context.view_layer.objects:
        raise Mistake(f"{what} '{thing.name}' isn't in this view layer")


def expect_mesh(context, thing, what):
    expect(context, thing, what, "MESH", "a mesh object")


def frames_wanted(context):
    """The frames that the settings name."""
    own = context.scene.npt
    scene = (context.scene.frame_start, context.scene.frame_end)
    first, last = scene if own.use_scene_range else (own.frame_start, own.frame_end)
    frames = list(range(first, last + 1, own.frame_step))
    if not frames:
        raise Mistake(f"No frames: the first, {first}, lies behind the last, {last}")
    return frames
