// The page of npt view. What it shows stands in the element #scene as JSON, its numbers in elements [data-chunk]: base64,
// most of them deflated (page.cpp writes both). Panels stand side by side on one canvas and share one camera.
'use strict';

(() => {
  const element = (id) => document.getElementById(id);
  const data = JSON.parse(element('scene').textContent);
  const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
  const lens = 24;  // degrees, as a portrait's
  const firstView = { yaw: 28, pitch: 8 };

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

  // Vertices in one place are one for the light: seams of textures don't show.
  function placesOf(positions) {
    const seen = new Map();
    const places = new Uint32Array(positions.length / 3);
    let shared = false;
    for (let v = 0; v < places.length; ++v) {
      const key = (positions[3 * v] * 65536 + positions[3 * v + 1]) * 65536 + positions[3 * v + 2];
      const found = seen.get(key);
      if (found === undefined) seen.set(key, v);
      else shared = true;
      places[v] = found === undefined ? v : found;
    }
    return shared ? places : null;
  }

  function setNormals(xyz, faces, places, normals) {
    normals.fill(0);
    const at = places ? (v) => 3 * places[v] : (v) => 3 * v;
    for (let i = 0; i < faces.length; i += 3) {
      const a = 3 * faces[i], b = 3 * faces[i + 1], c = 3 * faces[i + 2];
      const ux = xyz[b] - xyz[a], uy = xyz[b + 1] - xyz[a + 1], uz = xyz[b + 2] - xyz[a + 2];
      const vx = xyz[c] - xyz[a], vy = xyz[c + 1] - xyz[a + 1], vz = xyz[c + 2] - xyz[a + 2];
      const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      for (let k = 0; k < 3; ++k) {
        const n = at(faces[i + k]);
        normals[n] += nx, normals[n + 1] += ny, normals[n + 2] += nz;
      }
    }
    for (let n = 0; n < normals.length; n += 3) {
      const from = places ? 3 * places[n / 3] : n;
      if (from !== n) {
        normals[n] = normals[from], normals[n + 1] = normals[from + 1], normals[n + 2] = normals[from + 2];
        continue;
      }
      const length = Math.hypot(normals[n], normals[n + 1], normals[n + 2]) || 1;
      normals[n] /= length, normals[n + 1] /= length, normals[n + 2] /= length;
    }
  }

  // Each edge once. `inner`: a bit for each side of a triangle that no face of the file has.
  function edgesOf(faces, inner) {
    const seen = new Set();
    const edges = [];
    for (let i = 0; i < faces.length; ++i) {
      const triangle = Math.floor(i / 3), side = i % 3;
      if (inner && (inner[triangle] >> side) & 1) continue;
      const a = faces[i], b = faces[3 * triangle + (side + 1) % 3];
      const key = a < b ? a * 4294967296 + b : b * 4294967296 + a;
      if (seen.has(key)) continue;
      seen.add(key);
      edges.push(a, b);
    }
    return new Uint32Array(edges);
  }

  let heatTable = null;  // 256 colours, linear
  function makeHeatTable() {
    heatTable = new Float32Array(3 * 256);
    const stops = data.heat.colours.map((text) => new THREE.Color(text));
    for (let i = 0; i < 256; ++i) {
      const place = i / 255 * (stops.length - 1), low = Math.min(Math.floor(place), stops.length - 2);
      stops[low].clone().lerp(stops[low + 1], place - low).toArray(heatTable, 3 * i);
    }
  }

  // Colours that say something keep a share of light without direction, to be compared with their legend.
  function lightEvenly(material) {
    const share = { value: 0 };
    material.onBeforeCompile = (shader) => {
      shader.uniforms.evenLight = share;
      shader.fragmentShader = 'uniform float evenLight;\n' + shader.fragmentShader.replace(
        '#include <opaque_fragment>',
        'outgoingLight = mix(outgoingLight, diffuseColor.rgb, evenLight);\n#include <opaque_fragment>');
    };
    return share;
  }

  class MeshPanel {
    constructor(description) { this.description = description; }

    async load() {
      const m = this.description.mesh;
      this.frames = m.frames;
      this.seconds = m.frames / data.fps;
      this.positions = decodePositions(await chunk(m.positions), m.vertices, m.frames);
      this.faces = decodeFaces(await chunk(m.faces), 3 * m.triangles, m.planes);
      this.inner = 'inner' in m ? await chunk(m.inner) : null;
      this.errors = 'errors' in m ? decodeErrors(await chunk(m.errors), m.vertices, m.frames) : null;
      const places = placesOf(this.positions[0]);
      this.places = places;

      this.geometry = new THREE.BufferGeometry();
      this.xyz = new Float32Array(3 * m.vertices);
      this.normals = new Float32Array(3 * m.vertices);
      this.colours = new Float32Array(3 * m.vertices);
      this.own = 'colours' in m ? await chunk(m.colours) : null;
      this.geometry.setAttribute('position', new THREE.BufferAttribute(this.xyz, 3));
      this.geometry.setAttribute('color', new THREE.BufferAttribute(this.colours, 3));
      this.object = new THREE.Group();
      if (this.faces.length > 0) {
        this.geometry.setAttribute('normal', new THREE.BufferAttribute(this.normals, 3));
        this.geometry.setIndex(new THREE.BufferAttribute(this.faces, 1));
        const material = new THREE.MeshStandardMaterial({
          vertexColors: true, roughness: 0.8, metalness: 0, side: THREE.DoubleSide, shadowSide: THREE.DoubleSide,
          polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
        });
        this.evenLight = lightEvenly(material);
        const mesh = new THREE.Mesh(this.geometry, material);
        mesh.castShadow = mesh.receiveShadow = true;
        mesh.frustumCulled = false;
        this.object.add(mesh);
      } else {
        const material = new THREE.PointsMaterial({ vertexColors: true, size: 3, sizeAttenuation: false });
        const points = new THREE.Points(this.geometry, material);
        points.frustumCulled = false;
        this.object.add(points);
      }
      this.shown = -1;
      this.paint();
      this.setTime(0);
      const low = new THREE.Vector3(...m.low), high = new THREE.Vector3(...m.high);
      this.box = new THREE.Box3(low, high);
    }

    setTime(seconds) {
      const frame = this.frames === 1 ? 0 : Math.floor(seconds * data.fps + 1e-6) % this.frames;
      if (frame === this.shown) return;
      this.shown = frame;
      const m = this.description.mesh, q = this.positions[frame];
      const step = [0, 1, 2].map((k) => (m.high[k] - m.low[k]) / 65535);
      for (let i = 0; i < q.length; i += 3) {
        this.xyz[i] = m.low[0] + q[i] * step[0];
        this.xyz[i + 1] = m.low[1] + q[i + 1] * step[1];
        this.xyz[i + 2] = m.low[2] + q[i + 2] * step[2];
      }
      this.geometry.attributes.position.needsUpdate = true;
      if (this.faces.length > 0) {
        setNormals(this.xyz, this.faces, this.places, this.normals);
        this.geometry.attributes.normal.needsUpdate = true;
      }
      this.geometry.boundingSphere = null;
      this.geometry.boundingBox = null;
      if (this.errors && state.heat) this.paint();
    }

    paint() {
      const colour = new THREE.Color();
      if (this.errors && state.heat) {
        const errors = this.errors[Math.max(this.shown, 0)];
        const scale = this.description.mesh.error_high / 65535 / data.heat.high;
        for (let v = 0; v < errors.length; ++v) {
          const t = Math.min(255, Math.round(255 * errors[v] * scale));
          for (let k = 0; k < 3; ++k) this.colours[3 * v + k] = heatTable[3 * t + k];
        }
      } else if (this.own) {
        for (let v = 0; v < this.own.length; v += 3) {
          colour.setRGB(this.own[v] / 255, this.own[v + 1] / 255, this.own[v + 2] / 255, THREE.SRGBColorSpace);
          colour.toArray(this.colours, v);
        }
      } else {
        colour.set(this.description.colour);
        for (let v = 0; v < this.colours.length; v += 3) colour.toArray(this.colours, v);
      }
      if (this.evenLight) this.evenLight.value = this.errors && state.heat ? 0.5 : 0;
      this.geometry.attributes.color.needsUpdate = true;
    }

    setWire(on) {
      if (on && !this.wire && this.faces.length > 0) {
        const lines = new THREE.BufferGeometry();
        lines.setAttribute('position', this.geometry.attributes.position);
        lines.setIndex(new THREE.BufferAttribute(edgesOf(this.faces, this.inner), 1));
        this.wire = new THREE.LineSegments(lines, wireMaterial);
        this.wire.frustumCulled = false;
        this.object.add(this.wire);
      }
      if (this.wire) this.wire.visible = on;
    }

    // Millimetres at a corner that is hit, or null.
    errorAt(hit) {
      if (!this.errors || !state.heat || !hit.face) return null;
      const e = this.errors[this.shown], scale = this.description.mesh.error_high / 65535;
      return Math.max(e[hit.face.a], e[hit.face.b], e[hit.face.c]) * scale;
    }
  }

  // A GLB file as three.js loads it, with its materials and clips.
  class FilePanel {
    constructor(description) { this.description = description; }

    async load() {
      const bytes = await chunk(this.description.glb);
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
    get seconds() { return this.clip ? Math.max(this.clip.duration, 1e-6) : 0; }

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
    paint() {}
    setWire(on) {
      if (!this.wires) {
        this.wires = [];
        if (!on) return;
        this.object.traverse((node) => {
          if (node.isMesh) this.wires.push(...(Array.isArray(node.material) ? node.material : [node.material]));
        });
      }
      for (const material of this.wires) material.wireframe = on;
    }
    errorAt() { return null; }
  }

  // ---- the studio ----

  const state = { group: 0, panels: [], heat: true, wire: false, playing: false, time: 0, frames: 1, seconds: 0, scales: [] };
  let renderer, world, camera, controls, holder, floor, shadow, wireMaterial, key, head;
  let dirty = true;

  function makeStudio() {
    renderer = new THREE.WebGLRenderer({ canvas: element('canvas'), antialias: true, alpha: true });
    renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.VSMShadowMap;
    renderer.autoClear = false;
    wireMaterial = new THREE.LineBasicMaterial({ color: 0x1c2126, transparent: true, opacity: 0.45 });

    world = new THREE.Scene();
    holder = new THREE.Group();
    world.add(holder);
    world.add(new THREE.HemisphereLight(0xffffff, 0xcfc8be, 1.75));
    key = new THREE.DirectionalLight(0xfff6ec, 1.9);
    key.castShadow = true;
    key.shadow.mapSize.set(1024, 1024);
    key.shadow.radius = 6;
    key.shadow.blurSamples = 12;
    key.shadow.bias = -0.0006;
    key.shadow.normalBias = 0.016;
    world.add(key, key.target);
    const rim = new THREE.DirectionalLight(0xe6eeff, 0.8);
    rim.position.set(1.6, 1.2, -2);
    world.add(rim);

    camera = new THREE.PerspectiveCamera(lens, 1, 0.01, 100);
    head = new THREE.DirectionalLight(0xffffff, 0.35);
    camera.add(head);
    world.add(camera);

    const plane = new THREE.PlaneGeometry(1, 1).rotateX(-Math.PI / 2);
    shadow = new THREE.Mesh(plane, new THREE.ShadowMaterial({ opacity: 0.2, depthWrite: false }));
    // It fades out before it meets the next panel.
    shadow.material.onBeforeCompile = (shader) => {
      shader.vertexShader = 'varying vec2 onGround;\n' + shader.vertexShader.replace(
        '#include <begin_vertex>', '#include <begin_vertex>\nonGround = position.xz;');
      shader.fragmentShader = 'varying vec2 onGround;\n' + shader.fragmentShader.replace(
        '#include <fog_fragment>',
        'gl_FragColor.a *= 1.0 - smoothstep(0.05, 0.11, length(onGround));\n#include <fog_fragment>');
    };
    shadow.receiveShadow = true;
    floor = new THREE.Mesh(plane, new THREE.MeshBasicMaterial({ map: glow(), transparent: true, depthWrite: false }));
    floor.position.y = -0.002;
    floor.renderOrder = -2;
    shadow.renderOrder = -1;
    world.add(floor, shadow);

    controls = new THREE.OrbitControls(camera, element('canvas'));
    controls.enableDamping = !calm;
    controls.dampingFactor = 0.12;
    controls.addEventListener('change', redraw);
  }

  // A disc of light on the ground that fades out.
  function glow() {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = 256;
    const context = canvas.getContext('2d');
    const gradient = context.createRadialGradient(128, 128, 10, 128, 128, 127);
    gradient.addColorStop(0, 'rgba(255,255,255,1)');
    gradient.addColorStop(0.5, 'rgba(255,255,255,0.55)');
    gradient.addColorStop(1, 'rgba(255,255,255,0)');
    context.fillStyle = gradient;
    context.fillRect(0, 0, 256, 256);
    const texture = new THREE.CanvasTexture(canvas);
    texture.colorSpace = THREE.SRGBColorSpace;
    return texture;
  }

  function redraw() { dirty = true; }

  // The figures on the ground, centred, at one scale; each at its own where they differ by more than threefold (other units).
  function place() {
    const sizes = state.panels.map(({ box }) => {
      const size = box.getSize(new THREE.Vector3());
      return Math.max(size.x, size.y, size.z) || 1;
    });
    const common = Math.max(...sizes) < 3 * Math.min(...sizes);
    let width = 0, height = 0, across = 0;
    state.panels.forEach((panel, i) => {
      const scale = 1 / (common ? Math.max(...sizes) : sizes[i]);
      const centre = panel.box.getCenter(new THREE.Vector3()), size = panel.box.getSize(new THREE.Vector3());
      panel.root = new THREE.Group();
      panel.root.add(panel.object);
      panel.root.scale.setScalar(scale);
      panel.root.position.set(-centre.x * scale, -panel.box.min.y * scale, -centre.z * scale);
      holder.add(panel.root);
      const yaw = firstView.yaw * Math.PI / 180;
      width = Math.max(width, scale * (size.x * Math.cos(yaw) + size.z * Math.sin(yaw)));
      across = Math.max(across, scale * Math.hypot(size.x, size.z));
      height = Math.max(height, size.y * scale);
    });
    state.extent = { width, height, radius: 0.5 * Math.hypot(across, height) };
    const r = state.extent.radius;
    floor.scale.setScalar(7 * r), shadow.scale.setScalar(12 * r);
    key.target.position.set(0, height / 2, 0);
    key.position.set(-0.75, 2.5, 1.25).multiplyScalar(2 * r).add(key.target.position);
    Object.assign(key.shadow.camera, { left: -1.7 * r, right: 1.7 * r, top: 1.7 * r, bottom: -1.7 * r, near: 0.1 * r, far: 12 * r });
    key.shadow.camera.updateProjectionMatrix();
  }

  // Columns such that figures come out largest.
  function grid() {
    const width = element('stage').clientWidth, height = element('stage').clientHeight;
    const count = state.panels.length, { extent } = state;
    let best = { columns: 1, rows: count, size: 0 };
    for (let columns = 1; columns <= count; ++columns) {
      const rows = Math.ceil(count / columns);
      const size = Math.min(width / columns / extent.width, (height / rows - 48) / extent.height);
      if (size > best.size * 1.02) best = { columns, rows, size };
    }
    return { ...best, width, height };
  }

  // The part of a cell below the figure.
  const captionHeight = (cell) => (cell.height > 150 ? 48 : 0);

  // The camera for a cell: the figure stands above the caption, the ground goes on below it.
  function aim(cell) {
    camera.aspect = cell.width / cell.height;
    camera.setViewOffset(cell.width, cell.height, 0, captionHeight(cell) / 2, cell.width, cell.height);
  }

  function lookFrom(yaw, pitch) {
    const cell = cells()[0];
    const { extent } = state;
    const free = (cell.height - captionHeight(cell)) / cell.height;
    const half = Math.tan(lens * Math.PI / 360);
    const tall = extent.height / free, wide = extent.width * cell.height / cell.width;
    const distance = 0.5 * Math.max(tall, wide) * 1.08 / half + 0.25 * extent.radius;
    controls.target.set(0, extent.height * 0.49, 0);
    const y = yaw * Math.PI / 180, p = pitch * Math.PI / 180;
    camera.position.set(Math.sin(y) * Math.cos(p), Math.sin(p), Math.cos(y) * Math.cos(p)).multiplyScalar(distance).add(controls.target);
    camera.near = extent.radius * 0.02, camera.far = distance + extent.radius * 40;
    controls.minDistance = extent.radius * 0.1, controls.maxDistance = distance * 6;
    controls.update();
    redraw();
  }

  // Turns by degrees, or comes nearer by a factor, as the mouse does.
  function turn(yaw, pitch, factor) {
    const offset = camera.position.clone().sub(controls.target);
    const length = offset.length() * factor;
    const angle = Math.atan2(offset.x, offset.z) + yaw * Math.PI / 180;
    const lift = Math.max(-1.5, Math.min(1.5, Math.asin(offset.y / offset.length()) + pitch * Math.PI / 180));
    offset.set(Math.sin(angle) * Math.cos(lift), Math.sin(lift), Math.cos(angle) * Math.cos(lift));
    camera.position.copy(controls.target).addScaledVector(offset, length);
    controls.update();
    redraw();
  }

  function cells() {
    const { columns, rows, width, height } = grid();
    return state.panels.map((_, i) => ({
      x: (i % columns) * width / columns, y: Math.floor(i / columns) * height / rows, width: width / columns, height: height / rows,
    }));
  }

  function draw() {
    const width = element('stage').clientWidth, height = element('stage').clientHeight;
    renderer.setSize(width, height, false);
    renderer.setScissorTest(false);
    renderer.clear();
    renderer.setScissorTest(true);
    cells().forEach((cell, i) => {
      state.panels.forEach((panel, k) => { panel.root.visible = k === i; });
      renderer.setViewport(cell.x, height - cell.y - cell.height, cell.width, cell.height);
      renderer.setScissor(cell.x, height - cell.y - cell.height, cell.width, cell.height);
      aim(cell);
      renderer.render(world, camera);
    });
  }

  function layCaptions() {
    const captions = element('captions');
    captions.replaceChildren();
    cells().forEach((cell, i) => {
      const { caption, detail } = state.panels[i].description;
      const line = document.createElement('p');
      line.textContent = caption;
      if (detail) {
        const small = document.createElement('small');
        small.textContent = detail;
        line.append(small);
      }
      Object.assign(line.style, { left: `${cell.x}px`, width: `${cell.width}px`, top: `${cell.y + cell.height - 5}px` });
      captions.append(line);
    });
  }

  // ---- what the buttons do ----

  function setTime(time) {
    state.time = time;
    for (const panel of state.panels) panel.setTime(time);
    const frame = Math.min(state.frames - 1, Math.floor(time * data.fps + 1e-6));
    element('time').value = frame;
    element('frame').textContent = `${frame + 1} / ${state.frames}`;
    redraw();
  }
  function setFrame(frame) {
    setTime((Math.max(0, Math.min(state.frames - 1, frame)) + 1e-3) / data.fps);
  }
  const frameNow = () => Number(element('time').value);

  function setPlaying(on) {
    state.playing = on && state.frames > 1;
    element('play').classList.toggle('playing', state.playing);
    element('play').setAttribute('aria-label', state.playing ? 'Pause' : 'Play');
    before = performance.now();
  }

  function setWire(on) {
    state.wire = on;
    element('wire').setAttribute('aria-pressed', on);
    for (const panel of state.panels) panel.setWire(on);
    redraw();
  }

  function setHeat(on) {
    state.heat = on;
    element('heat').setAttribute('aria-pressed', on);
    for (const panel of state.panels) panel.paint();
    element('legend').hidden = !on || !state.panels.some((panel) => panel.errors);
    redraw();
  }

  const dark = matchMedia('(prefers-color-scheme: dark)');
  let chosenTheme = null;
  function setTheme() {
    const theme = chosenTheme || (dark.matches ? 'dark' : 'light');
    document.documentElement.dataset.theme = theme;
    element('theme').textContent = theme === 'dark' ? 'Light' : 'Dark';
    if (!renderer) return;
    wireMaterial.color.set(theme === 'dark' ? 0x0b0d10 : 0x1c2126);
    floor.material.color.set(theme === 'dark' ? 0x50585f : 0xffffff);
    floor.material.opacity = theme === 'dark' ? 0.55 : 0.9;
    shadow.material.opacity = theme === 'dark' ? 0.5 : 0.24;
    redraw();
  }
  function toggleTheme() {
    chosenTheme = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
    setTheme();
  }

  function setTimeline() {
    state.frames = Math.max(...state.panels.map((panel) => panel.frames));
    element('player').hidden = state.frames < 2;
    element('time').max = state.frames - 1;
    setFrame(0);
    setPlaying(state.frames > 1 && !calm);
  }

  function setClips() {
    const names = [...new Set(state.panels.flatMap((panel) => (panel.clips || []).map((clip) => clip.name)))];
    element('clips').hidden = names.length < 2;
    element('clip').replaceChildren(...names.map((name) => new Option(name, name)));
  }

  async function setGroup(number) {
    const group = data.groups[number];
    state.group = number;
    element('group').value = number;
    show('Loading');
    document.documentElement.dataset.ready = '';
    holder.clear();
    for (const panel of state.panels) {
      panel.object.traverse((node) => { if (node.geometry) node.geometry.dispose(); });
    }
    state.panels = [];
    const panels = group.panels.map((panel) => ('glb' in panel ? new FilePanel(panel) : new MeshPanel(panel)));
    for (const panel of panels) await panel.load();
    if (state.group !== number) return;  // another was asked for meanwhile
    state.panels = panels;
    place();
    setClips();
    setTimeline();
    setWire(state.wire);
    element('heat').hidden = !panels.some((panel) => panel.errors);
    setHeat(state.heat);
    lookFrom(firstView.yaw, firstView.pitch);
    layCaptions();
    show('');
    draw();
    document.documentElement.dataset.ready = 'yes';
  }

  let before = 0;
  function tick(now) {
    requestAnimationFrame(tick);
    if (state.panels.length === 0) return;
    if (state.playing) {
      const length = state.frames / data.fps;
      // A frame's time may lie before the press of the button.
      const passed = Math.max(0, Math.min(0.25, (now - before) / 1000)) * Number(element('speed').value);
      setTime((state.time + passed) % length);
    }
    before = now;
    controls.update();
    if (!dirty) return;
    dirty = false;
    draw();
  }

  // The error under the pointer.
  function read(event) {
    const output = element('reading');
    output.hidden = true;
    if (event.buttons !== 0 || !state.heat || !state.panels.some((panel) => panel.errors)) return;
    const box = element('canvas').getBoundingClientRect();
    const x = event.clientX - box.left, y = event.clientY - box.top;
    cells().forEach((cell, i) => {
      const panel = state.panels[i];
      if (!panel.errors || x < cell.x || x >= cell.x + cell.width || y < cell.y || y >= cell.y + cell.height) return;
      aim(cell);
      const ray = new THREE.Raycaster();
      ray.setFromCamera(new THREE.Vector2(2 * (x - cell.x) / cell.width - 1, 1 - 2 * (y - cell.y) / cell.height), camera);
      const hit = ray.intersectObject(panel.object.children[0])[0];
      const error = hit && panel.errorAt(hit);
      if (error === undefined || error === null) return;
      output.textContent = `${error < 10 ? error.toFixed(1) : Math.round(error)} mm`;
      Object.assign(output.style, { left: `${x}px`, top: `${y}px` });
      output.hidden = false;
    });
  }

  function listen() {
    element('play').onclick = () => setPlaying(!state.playing);
    element('time').oninput = () => { setPlaying(false); setFrame(frameNow()); };
    element('wire').onclick = () => setWire(!state.wire);
    element('heat').onclick = () => setHeat(!state.heat);
    element('front').onclick = () => lookFrom(0, 4);
    element('side').onclick = () => lookFrom(90, 4);
    element('back').onclick = () => lookFrom(180, 4);
    element('reset').onclick = () => lookFrom(firstView.yaw, firstView.pitch);
    element('theme').onclick = toggleTheme;
    element('help').onclick = () => element('keys').showModal();
    element('group').onchange = (event) => setGroup(Number(event.target.value)).catch(fail);
    element('clip').onchange = (event) => {
      for (const panel of state.panels) if (panel.setClip) panel.setClip(event.target.value);
      setTimeline();
    };
    dark.addEventListener('change', setTheme);
    element('canvas').addEventListener('pointermove', read);
    element('canvas').addEventListener('pointerleave', () => { element('reading').hidden = true; });
    new ResizeObserver(() => {
      if (state.panels.length === 0) return;
      layCaptions();
      draw();
    }).observe(element('stage'));

    const keys = {
      ' ': () => setPlaying(!state.playing),
      ',': () => { setPlaying(false); setFrame(frameNow() - 1); },
      '.': () => { setPlaying(false); setFrame(frameNow() + 1); },
      Home: () => setFrame(0), End: () => setFrame(state.frames - 1),
      '[': () => { if (state.group > 0) setGroup(state.group - 1).catch(fail); },
      ']': () => { if (state.group + 1 < data.groups.length) setGroup(state.group + 1).catch(fail); },
      ArrowLeft: () => turn(-10, 0, 1), ArrowRight: () => turn(10, 0, 1),
      ArrowUp: () => turn(0, 10, 1), ArrowDown: () => turn(0, -10, 1),
      '+': () => turn(0, 0, 0.9), '=': () => turn(0, 0, 0.9), '-': () => turn(0, 0, 1 / 0.9),
      1: () => element('front').click(), 2: () => element('side').click(), 3: () => element('back').click(),
      r: () => element('reset').click(), w: () => element('wire').click(), d: toggleTheme,
      h: () => { if (!element('heat').hidden) element('heat').click(); },
      '?': () => element('keys').showModal(),
    };
    addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || element('keys').open || state.panels.length === 0) return;
      // Controls keep the keys that are their own.
      const own = { SELECT: /^(Arrow|Home|End| |.$)/, INPUT: /^(Arrow|Home|End)/, BUTTON: /^ $/ }[event.target.tagName];
      if (own && own.test(event.key)) return;
      const action = keys[event.key] || keys[event.key.toLowerCase()];
      if (!action) return;
      event.preventDefault();
      action();
    });
  }

  function fail(error) {
    show(`This page can't be shown: ${error && error.message ? error.message : error}`);
    document.documentElement.dataset.ready = 'failed';
    console.error(error);
  }

  async function start() {
    setTheme();
    if (!('DecompressionStream' in window)) throw new Error('the browser is older than 2023');
    const library = document.createElement('script');
    library.textContent = new TextDecoder().decode(await chunk('three'));
    document.head.append(library);
    if (data.heat) {
      makeHeatTable();
      element('legend-label').textContent = data.heat.label;
      element('legend-high').textContent = `${data.heat.high}${data.heat.open ? '+' : ''} mm`;
      element('legend-bar').style.background = `linear-gradient(90deg, ${data.heat.colours.join(', ')})`;
    }
    makeStudio();
    setTheme();
    listen();
    element('groups').hidden = data.groups.length < 2;
    element('group').replaceChildren(...data.groups.map((group, i) => new Option(group.caption || `${i + 1}`, i)));
    await setGroup(0);
    requestAnimationFrame(tick);
  }

  start().catch(fail);
})();
