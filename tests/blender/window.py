"""The add-on in Blender's window: the panel, a transfer that is cancelled with Esc, one that ends, and a picture of it. Run by
tests/platforms/blender.sh: blender --factory-startup --enable-event-simulate --python window.py -- FOLDER FRAMES [PICTURE]
FOLDER: files that test_addon.py made, its add-on installed; FRAMES: so many of its 24 frames; PICTURE: PNG file."""

import os
import sys
import time
import traceback
from pathlib import Path

import bpy

FOLDER, FRAMES, *PICTURE = sys.argv[sys.argv.index("--") + 1 :]
FRAMES = int(FRAMES)


def load(file, name, x, colour):
    bpy.ops.import_scene.obj(filepath=str(Path(FOLDER) / file), split_mode="OFF")
    thing = bpy.context.selected_objects[0]
    thing.name, thing.location.x = name, x
    material = bpy.data.materials.new(name)
    material.diffuse_color = colour
    thing.data.materials.clear()
    thing.data.materials.append(material)
    for polygon in thing.data.polygons:
        polygon.use_smooth = True
    return thing


def walker():
    thing = load("walk/00.obj", "Walker", 1.3, (0.8, 0.65, 0.4, 1))
    thing.shape_key_add(name="Basis")
    for i in range(FRAMES):
        lines = (Path(FOLDER) / f"walk/{i:02}.obj").read_text().splitlines()
        key = thing.shape_key_add(name=f"{i}")
        key.data.foreach_set("co", [float(x) for line in lines if line.startswith("v ") for x in line.split()[1:4]])
        for frame, value in ((i, 0), (i + 1, 1), (i + 2, 0)):
            key.value = value
            key.keyframe_insert("value", frame=frame)
    return thing


def view(context):
    area = max((a for a in context.screen.areas if a.type == "VIEW_3D"), key=lambda a: a.width * a.height)
    return area, {r.type: r for r in area.regions}


def press(window, key, x=0, y=0, value="PRESS"):
    window.event_simulate(type=key, value=value, x=x, y=y)


def steps():
    """Each yield lets Blender draw and handle events; what is yielded is the time to wait."""
    from npt_pose_transfer.operators import NPT_OT_transfer

    window = bpy.context.window_manager.windows[0]
    context = bpy.context
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    who = load("identity.obj", "Ann", -1.3, (0.35, 0.55, 0.8, 1))
    pose = walker()
    own = context.scene.npt
    own.identity, own.pose, own.source = who, pose, "FRAMES"
    context.scene.frame_start, context.scene.frame_end = 1, FRAMES
    context.scene.frame_set(6)
    area, regions = view(context)
    space = area.spaces.active
    space.show_region_ui, space.overlay.show_cursor, space.show_gizmo = True, False, False
    space.shading.color_type, space.shading.light = "MATERIAL", "STUDIO"
    space.overlay.show_outline_selected = False
    yield 1
    # The sidebar's tab: below those that Blender has.
    area, regions = view(context)
    side = regions["UI"]
    for step in range(20, side.height, 12):
        if NPT_panel_drawn[0]:
            break
        x, y = side.x + side.width - 8, side.y + side.height - step
        press(window, "MOUSEMOVE", x, y, "NOTHING")
        yield 0.05
        press(window, "LEFTMOUSE", x, y)
        press(window, "LEFTMOUSE", x, y, "RELEASE")
        yield 0.15
    assert NPT_panel_drawn[0], "no click opened the panel"

    def start():
        with context.temp_override(window=window, area=area, region=regions["WINDOW"]):
            return bpy.ops.npt.transfer("INVOKE_DEFAULT")

    # Esc stops it; nothing is changed.
    before = set(bpy.data.objects), set(bpy.data.meshes)
    assert start() == {"RUNNING_MODAL"}
    job = NPT_OT_transfer.running.job
    while job.done < 2:
        yield 0.02
    middle = regions["WINDOW"].x + 200, regions["WINDOW"].y + 200
    press(window, "MOUSEMOVE", *middle, "NOTHING")
    press(window, "ESC", *middle)
    while NPT_OT_transfer.running is not None:
        yield 0.02
    assert (
        job.done < FRAMES
        and (set(bpy.data.objects), set(bpy.data.meshes)) == before
        and context.scene.frame_current == 6
    )
    print(f"Esc after {job.done} of {FRAMES} frames: nothing was changed")
    press(window, "ESC", *middle, "RELEASE")
    yield 0.1
    # The button of the panel does so, too.
    assert start() == {"RUNNING_MODAL"}
    yield 0.2
    assert bpy.ops.npt.cancel() == {"FINISHED"}
    while NPT_OT_transfer.running is not None:
        yield 0.02
    assert set(bpy.data.objects) == before[0]
    # And one to its end, with the window drawn in between.
    draws = NPT_panel_drawn[0]
    begin = time.time()
    start()
    while NPT_OT_transfer.running is not None:
        yield 0.02
    made = context.view_layer.objects.active
    assert made.name == "Ann as Walker" and len(made.data.shape_keys.key_blocks) == FRAMES + 1, made.name
    print(
        f"{FRAMES} frames in {time.time() - begin:.1f} s, the panel drawn {NPT_panel_drawn[0] - draws} times meanwhile"
    )
    made.location.x = 0
    with context.temp_override(window=window, area=area, region=regions["WINDOW"]):
        bpy.ops.ed.undo_push(message="seen")
        bpy.ops.view3d.view_axis(type="FRONT")
    space.region_3d.view_perspective = "PERSP"
    from mathutils import Euler

    space.region_3d.view_rotation = Euler((1.45, 0, 0.45)).to_quaternion()
    space.region_3d.view_location, space.region_3d.view_distance = (0.25, 0, 0.0), 4.2
    yield 1
    if PICTURE:
        bpy.ops.screen.screenshot(filepath=PICTURE[0])
        print(PICTURE[0])


NPT_panel_drawn = [0]


def main():
    bpy.context.preferences.view.show_splash = False
    bpy.ops.preferences.addon_enable(module="npt_pose_transfer")
    from npt_pose_transfer.panel import NPT_PT_transfer

    draw = NPT_PT_transfer.draw

    def counted(self, context):
        NPT_panel_drawn[0] += 1
        draw(self, context)

    NPT_PT_transfer.draw = counted
    running, until = steps(), time.time() + 240

    def tick():
        try:
            if time.time() > until:
                raise TimeoutError("the window test takes more than four minutes")
            return next(running)
        except StopIteration:
            status = 0
        except BaseException:
            traceback.print_exc()
            status = 1
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    bpy.app.timers.register(tick, first_interval=1)


main()
