// The demo's panels, on the stage of stage.js (the global npt): identity, pose and result, which can be laid over each other and painted.

const heatColours = ['#e4e1dc', '#f7df8b', '#f7ae4b', '#e5692f', '#b4262f', '#611030'];

// A mesh and its frames: { caption, detail, colour, faces, frames: [Float32Array] }.
export class Panel extends npt.MeshPanel {
  constructor({ faces, frames, ...description }) {
    super({ ...description, positions: frames, frames: frames.length, shown: -1 });
    this.setMesh(frames[0], faces);
    this.box = new THREE.Box3();
    for (const frame of frames) this.box.union(new THREE.Box3().setFromArray(frame));
    this.setFrame(0);
    this.paint(null);
  }
  setFrame(frame) {
    frame = Math.min(frame, this.frames - 1);
    if (frame === this.shown) return;
    this.shown = frame;
    this.xyz.set(this.positions[frame]);
    this.moved();
  }
  // Seen through, for laying it over another.
  setGhost(on) {
    if (this.material.transparent === on) return;
    Object.assign(this.material, { transparent: on, opacity: on ? 0.45 : 1, depthWrite: !on });
    this.solid.castShadow = this.solid.receiveShadow = !on && this.faces.length > 0;
    this.material.needsUpdate = true;
  }
}

export class Studio extends npt.Stage {
  frame = 0;
  overlay = false;
  table = npt.heatTable(heatColours);

  constructor() { super({ fade: [0.04, 0.085] }); }

  // Panels from the left; `aim`: whether the view begins anew.
  show(panels, aim) {
    this.setPanels(panels);
    this.frame = 0;
    if (aim) this.reset();
    this.layCaptions();
  }
  setCaptions(texts) {
    this.panels.forEach((panel, i) => Object.assign(panel, texts[i]));
    this.layCaptions();
  }
  setFrame(frame) {
    this.frame = frame;
    for (const panel of this.panels) panel.setFrame(frame);
    this.redraw();
  }
  setOverlay(on) {
    this.overlay = on;
    this.redraw();
  }
  // Colours of the result: as for npt.MeshPanel, without their table; or null.
  setHeat(heat) {
    this.panels[2]?.paint(heat && { ...heat, table: this.table });
    this.redraw();
  }
  setShown(cell) {
    super.setShown(cell);
    const over = this.overlay && cell === 2, pose = this.panels[1];
    pose.root.visible ||= over;
    pose.setGhost(over);
  }
}
