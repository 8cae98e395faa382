// The page of npt view, on the stage of stage.js. What it shows stands in the element #scene as JSON, its numbers in elements [data-chunk]:
// base64, most of them deflated (page.cpp writes both).
'use strict';

(() => {
  const { element } = npt;
  const data = JSON.parse(element('scene').textContent);
  const state = { group: 0, heat: true };
  let stage, player, heatTable = null;

  function show(message) {
    element('message').textContent = message;
    element('message').hidden = message === '';
  }

  // ---- the data ----

  async function chunk(number) {
    const source = document.querySelector(`[data-chunk="${number}"]`);
    const text = atob(source.textContent);
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
    if (!('deflated' in source.dataset)) return bytes;
    const format = source.dataset.deflated;
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream(format));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // Bytes in planes, lowest first, to the sums of differences that were folded to be small: 0, -1, 1, -2 as 0, 1, 2, 3.
  const joined = (bytes, count, planes, i) => {
    let value = 0;
    for (let p = planes - 1; p >= 0; --p) value = value * 256 + bytes[p * count + i];
    return value;
  };
  const unfolded = (value) => (value % 2 === 0 ? value / 2 : -(value + 1) / 2);

  function decodeFaces(bytes, count, planes) {
    const faces = new Uint32Array(count);
    let last = 0;
    for (let i = 0; i < count; ++i) faces[i] = last += unfolded(joined(bytes, count, planes, i));
    return faces;
  }

  // 16 bits a coordinate; the first frame as differences from vertex to vertex, others from frame to frame.
  function decodePositions(bytes, vertices, frames) {
    const count = 3 * vertices;
    const decoded = [];
    for (let f = 0; f < frames; ++f) {
      const frame = new Uint16Array(count);
      const part = bytes.subarray(2 * count * f, 2 * count * (f + 1));
      for (let i = 0; i < count; ++i) {
        const before = f > 0 ? decoded[f - 1][i] : i >= 3 ? frame[i - 3] : 0;
        const folded = part[i] + 256 * part[count + i];
        frame[i] = before + ((folded >> 1) ^ -(folded & 1));  // modulo 2^16
      }
      decoded.push(frame);
    }
    return decoded;
  }

  function decodeErrors(bytes, vertices, frames) {
    const decoded = [];
    for (let f = 0; f < frames; ++f) {
      const frame = new Uint16Array(vertices);
      const part = bytes.subarray(2 * vertices * f, 2 * vertices * (f + 1));
      for (let i = 0; i < vertices; ++i) frame[i] = part[i] + 256 * part[vertices + i];
      decoded.push(frame);
    }
    return decoded;
  }

  // ---- what a panel shows ----

  class MeshPanel extends npt.MeshPanel {
    async load() {
      const m = this.mesh;
      this.frames = m.frames;
      this.positions = decodePositions(await chunk(m.positions), m.vertices, m.frames);
      const faces = decodeFaces(await chunk(m.faces), 3 * m.triangles, m.planes);
      this.setMesh(this.positions[0], faces, 'inner' in m ? await chunk(m.inner) : null);
      this.errors = 'errors' in m ? decodeErrors(await chunk(m.errors), m.vertices, m.frames) : null;
      this.own = 'colours' in m ? await chunk(m.colours) : null;
      this.shown = -1;
      this.setTime(0);
      this.box = new THREE.Box3(new THREE.Vector3(...m.low), new THREE.Vector3(...m.high));
    }

    setTime(seconds) {
      const frame = this.frames === 1 ? 0 : Math.floor(seconds * data.fps + 1e-6) % this.frames;
      if (frame === this.shown) return;
      this.shown = frame;
      const m = this.mesh, q = this.positions[frame];
      const step = [0, 1, 2].map((k) => (m.high[k] - m.low[k]) / 65535);
      for (let i = 0; i < q.length; i += 3) {
        this.xyz[i] = m.low[0] + q[i] * step[0];
        this.xyz[i + 1] = m.low[1] + q[i + 1] * step[1];
        this.xyz[i + 2] = m.low[2] + q[i + 2] * step[2];
      }
      this.moved();
      if (this.errors && state.heat) this.setHeat();
    }

    setHeat() {
      const heat = this.errors && state.heat;
      this.paint(heat ? { values: this.errors[this.shown], unit: this.mesh.error_high / 65535, high: data.heat.high, table: heatTable } : null);
    }
    paintPlain() {
      if (!this.own) return super.paintPlain();
      const colour = new THREE.Color();
      for (let v = 0; v < this.own.length; v += 3) {
        colour.setRGB(this.own[v] / 255, this.own[v + 1] / 255, this.own[v + 2] / 255, THREE.SRGBColorSpace);
        colour.toArray(this.colours, v);
      }
    }
  }

  // A GLB file as three.js loads it, with its materials and clips.
  class FilePanel {
    constructor(description) { Object.assign(this, description); }

    async load() {
      const bytes = await chunk(this.glb);
      const file = await new THREE.GLTFLoader().parseAsync(bytes.buffer, '');
      this.object = file.scene;
      this.clips = file.animations;
      this.object.traverse((node) => {
        if (!node.isMesh) return;
        node.castShadow = node.receiveShadow = true;
        node.frustumCulled = false;
      });
      this.mixer = new THREE.AnimationMixer(this.object);
      this.setClip(this.clips.length > 0 ? this.clips[0].name : '');
      this.box = this.boxOfClip();
    }

    // The box of all that the clip goes through.
    boxOfClip() {
      const box = new THREE.Box3();
      let vertices = 1;
      this.object.traverse((node) => { if (node.isMesh) vertices += node.geometry.attributes.position.count; });
      const looks = this.clip ? Math.max(2, Math.min(12, Math.round(250000 / vertices))) : 1;
      for (let i = 0; i < looks; ++i) {
        if (this.clip) this.setTime(this.clip.duration * i / (looks - 1));
        this.object.updateMatrixWorld(true);
        box.union(new THREE.Box3().setFromObject(this.object, true));
      }
      this.setTime(0);
      return box;
    }

    get frames() { return this.clip && this.clip.duration > 0 ? Math.max(1, Math.round(this.clip.duration * data.fps)) : 1; }

    setClip(name) {
      if (this.clips.length === 0) return;
      this.clip = this.clips.find((clip) => clip.name === name) || this.clips[0];
      this.mixer.stopAllAction();
      this.mixer.clipAction(this.clip).play();
      this.setTime(0);
    }
    setTime(seconds) {
      if (!this.clip) return;
      const end = this.clip.duration;
      // The last key has a frame of its own, behind which a clip begins anew.
      const time = seconds < end + 1.01 / data.fps ? Math.min(seconds, end * (1 - 1e-6)) : seconds % end;
      this.mixer.setTime(end > 0 ? time : 0);
    }
    setHeat() {}
    setWire(on) {
      if (!this.wires) {
        if (!on) return;
        this.wires = [];
        this.object.traverse((node) => {
          if (node.isMesh) this.wires.push(...(Array.isArray(node.material) ? node.material : [node.material]));
        });
      }
      for (const material of this.wires) material.wireframe = on;
    }
    dispose() { this.object.traverse((node) => { if (node.geometry) node.geometry.dispose(); }); }
  }

  // ---- what the buttons do ----

  function setHeat(on) {
    state.heat = on;
    element('heat').setAttribute('aria-pressed', on);
    for (const panel of stage.panels) panel.setHeat();
    element('legend').hidden = !on || !stage.panels.some((panel) => panel.errors);
    stage.redraw();
  }

  function setTimeline() {
    player.setFrames(stage.frames);
    player.setFrame(0);
    player.setPlaying(!npt.calm);
  }

  function setClips() {
    const names = [...new Set(stage.panels.flatMap((panel) => (panel.clips || []).map((clip) => clip.name)))];
    element('clips').hidden = names.length < 2;
    element('clip').replaceChildren(...names.map((name) => new Option(name, name)));
  }

  async function setGroup(number) {
    const group = data.groups[number];
    state.group = number;
    element('group').value = number;
    show('Loading');
    document.documentElement.dataset.ready = '';
    stage.clear();
    const panels = group.panels.map((panel) => ('glb' in panel ? new FilePanel(panel) : new MeshPanel(panel)));
    for (const panel of panels) await panel.load();
    if (state.group !== number) return;  // another was asked for meanwhile
    stage.setPanels(panels);
    setClips();
    setTimeline();
    element('heat').hidden = !panels.some((panel) => panel.errors);
    setHeat(state.heat);
    stage.reset();
    stage.layCaptions();
    show('');
    stage.draw();
    document.documentElement.dataset.ready = 'yes';
  }

  function listen() {
    element('heat').onclick = () => setHeat(!state.heat);
    element('group').onchange = (event) => setGroup(Number(event.target.value)).catch(fail);
    element('clip').onchange = (event) => {
      for (const panel of stage.panels) if (panel.setClip) panel.setClip(event.target.value);
      setTimeline();
    };
    npt.listen(stage, player, {
      Home: () => player.setFrame(0), End: () => player.setFrame(player.frames - 1),
      '[': () => { if (state.group > 0) setGroup(state.group - 1).catch(fail); },
      ']': () => { if (state.group + 1 < data.groups.length) setGroup(state.group + 1).catch(fail); },
      h: () => { if (!element('heat').hidden) element('heat').click(); },
    });
  }

  function fail(error) {
    show(`This page can't be shown: ${error && error.message ? error.message : error}`);
    document.documentElement.dataset.ready = 'failed';
    console.error(error);
  }

  async function start() {
    npt.theme.follow();
    if (!('DecompressionStream' in window)) throw new Error('the browser is older than 2023');
    const library = document.createElement('script');
    library.textContent = new TextDecoder().decode(await chunk('three'));
    document.head.append(library);
    if (data.heat) {
      heatTable = npt.heatTable(data.heat.colours);
      element('legend-label').textContent = data.heat.label;
      element('legend-high').textContent = `${data.heat.high}${data.heat.open ? '+' : ''} mm`;
    }
    stage = new npt.Stage({ fade: [0.05, 0.11] });
    player = new npt.Player({
      fps: () => data.fps, speed: () => Number(element('speed').value),
      show: (time) => {
        for (const panel of stage.panels) panel.setTime(time);
        stage.redraw();
      },
    });
    listen();
    element('groups').hidden = data.groups.length < 2;
    element('group').replaceChildren(...data.groups.map((group, i) => new Option(group.caption || `${i + 1}`, i)));
    await setGroup(0);
    npt.run(stage, player);
  }

  start().catch(fail);
})();
