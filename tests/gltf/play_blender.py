"""Clips as Blender's importer plays them: blender --background --factory-startup --python play_blender.py -- FILE.glb ...
Beside each file NAME.json says where its joints are. Joints are bones of an armature, or objects where no mesh has them."""

import json
import sys
from pathlib import Path

import bpy
import numpy

if not hasattr(numpy, "bool"):
    numpy.bool = bool  # the importer of Blender 3.4 names it, the numpy that Debian 12 gives it has it no longer


def places(joints):
    """Where the joints are now, in glTF's axes; bones are named as nodes are."""
    bones = {bone.name: (thing, bone) for thing in bpy.data.objects if thing.type == "ARMATURE"
             for bone in thing.pose.bones}
    found = []
    for joint in joints:
        name = joint["name"][:63]  # Blender's longest name
        if name in bones:
            armature, bone = bones[name]
            place = armature.matrix_world @ bone.head
        else:
            place = bpy.data.objects[name].matrix_world.translation
        found.append((place.x, place.z, -place.y))
    return found


def play(clip):
    """The importer gives each clip an action for each armature or object, in a track of the clip's name."""
    for thing in bpy.data.objects:
        data = thing.animation_data
        if data is None:
            continue
        data.action = next((track.strips[0].action for track in data.nla_tracks if track.name == clip), None)
        for track in data.nla_tracks:
            track.mute = True


def farthest(played, fps):
    """How far the joints are off at most, as a part of the skeleton's size."""
    all_places = [place for row in played["places"] for place in row]
    size = max(max(axis) - min(axis) for axis in zip(*all_places))
    play(played["clip"])
    most = 0.0
    for time, expected in zip(played["times"], played["places"]):
        frame = time * fps
        bpy.context.scene.frame_set(int(frame), subframe=frame - int(frame))
        for place, other in zip(places(played["joints"]), expected):
            most = max(most, sum((a - b) ** 2 for a, b in zip(place, other)) ** 0.5)
    return most / size


files = sys.argv[sys.argv.index("--") + 1:]
good = bool(files)
for file in files:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=file)
    render = bpy.context.scene.render
    for played in json.loads(Path(file).with_suffix(".json").read_text()):
        if played["clip"] is None:
            continue  # Blender stands where the first clip begins
        off = farthest(played, render.fps / render.fps_base)
        print(f"{file}: {played['clip']}: {len(played['joints'])} joints, {len(played['times'])} times, "
              f"off by {off:.1e} of their size")
        good = good and off < 4e-3  # between keys Blender mixes quaternions' numbers: 2.6e-3 off in a fast run
sys.exit(0 if good else 1)
