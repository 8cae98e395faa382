"""The panel in the 3D view's sidebar."""

import bpy

from .operators import NPT_OT_cancel, NPT_OT_transfer


class NPT_Panel:
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "npt"


class NPT_PT_transfer(NPT_Panel, bpy.types.Panel):
    bl_label = "Pose Transfer"

    def draw(self, context):
        layout, own = self.layout, context.scene.npt
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(own, "identity")
        layout.separator()
        row = layout.row()
        row.use_property_split = False
        row.prop(own, "source", expand=True)
        layout.prop(own, {"COLLECTION": "collection", "ACTION": "armature"}.get(own.source, "pose"))
        if own.source == "ACTION":
            layout.prop(own, "action")
            layout.prop(own, "use_action_range")
            layout.prop(own, "foot_lock")
            layout.prop(own, "in_place")
            layout.prop(own, "clearance")
        if own.source == "FRAMES" or (own.source == "ACTION" and not own.use_action_range):
            layout.prop(own, "use_scene_range")
            frames = layout.column(align=True)
            if not own.use_scene_range:
                frames.prop(own, "frame_start")
                frames.prop(own, "frame_end")
            frames.prop(own, "frame_step")
        layout.prop(own, "rig")
        running = NPT_OT_transfer.running
        if running is None:
            row = layout.row()
            row.scale_y = 1.4
            row.operator(NPT_OT_transfer.bl_idname, icon="ARMATURE_DATA")
        else:
            job = running.job
            layout.label(
                text="Stopping ..." if running.cancelled else f"{job.done} of {job.total} done", icon="SORTTIME"
            )
            layout.operator(NPT_OT_cancel.bl_idname, icon="X")


class NPT_PT_options(NPT_Panel, bpy.types.Panel):
    bl_label = "Options"
    bl_parent_id = "NPT_PT_transfer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, own = self.layout, context.scene.npt
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(own, "method")
        layout.prop(own, "quality")
        layout.prop(own, "figure")
        layout.prop(own, "weights")
        if own.weights == "FILE":
            layout.prop(own, "weights_file")
        layout.prop(own, "refine")
        if own.refine:
            layout.prop(own, "refine_radius")
        network = layout.column(heading="Network")
        network.prop(own, "mirror")
        network.prop(own, "pairings")
        layout.prop(own, "seed")
        layout.prop(own, "threads")


classes = [NPT_PT_transfer, NPT_PT_options]
