"""Pose transfer in Blender: the pose of one mesh on another, without rig, markers or correspondence. A panel in the 3D view's
sidebar; the work is the npt package's, which lies in the add-on's folder."""

bl_info = {
    "name": "npt: neural pose transfer",
    "author": "npt",
    "version": (0, 0, 0),  # build_zip.sh writes npt's
    "blender": (3, 3, 0),
    "location": "3D View > Sidebar > npt",
    "description": "Puts the pose of one mesh onto another: no rig, no markers, no correspondence",
    "category": "Mesh",
}

import bpy

from . import npt  # noqa: F401  the vendored package: without its library the add-on says so when it is enabled
from . import operators, panel, settings, transfers


def register():
    npt.version()  # opens the library
    for part in (settings, operators, panel):
        for one in part.classes:
            bpy.utils.register_class(one)
    bpy.types.Scene.npt = bpy.props.PointerProperty(type=settings.NPT_Settings)


def unregister():
    transfers.forget()
    del bpy.types.Scene.npt
    for part in (panel, operators, settings):
        for one in reversed(part.classes):
            bpy.utils.unregister_class(one)
