// Meshes beside each other on one canvas with one camera, as on the pages of npt view (examples/npt/view/page.js). three.js stands in the
// global THREE.

const lens = 24;  // degrees, as a portrait's
const firstView = { yaw: 28, pitch: 8 };
export const heatColours = ['#e4e1dc', '#f7df8b', '#f7ae4b', '#e5692f', '#b4262f', '#611030'];

// Vertices in one place are one for the light: seams of textures don't show.
function placesOf(xyz) {
  const seen = new Map();
  const places = new Uint32Array(xyz.length / 3);
  let shared = false;
  for (let v = 0; v < places.length; ++v) {
    const key = `${xyz[3 * v]},${xyz[3 * v + 1]},${xyz[3 * v + 2]}`;
    const found = seen.get(key);
    if (found === undefined) seen.set(key, v);
    else shared = true;
    places[v] = found ?? v;
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

function edgesOf(faces) {
  const seen = new Set();
  const edges = [];
  for (let i = 0; i < faces.length; ++i) {
    const triangle = 3 * Math.floor(i / 3), a = faces[i], b = faces[triangle + (i - triangle + 1) % 3];
    const key = a < b ? a * 4294967296 + b : b * 4294967296 + a;
    if (seen.has(key)) continue;
    seen.add(key);
    edges.push(a, b);
  }
  return new Uint32Array(edges);
}

function heatTable() {
  const table = new Float32Array(3 * 256), stops = heatColours.map((text) => new THREE.Color(text));
  for (let i = 0; i < 256; ++i) {
    const place = i / 255 * (stops.length - 1), low = Math.min(Math.floor(place), stops.length - 2);
    stops[low].clone().lerp(stops[low + 1], place - low).toArray(table, 3 * i);
  }
  return table;
}

// Colours that say something keep a share of light without direction, to be compared with their legend.
function lightEvenly(material) {
  const share = { value: 0 };
  material.onBeforeCompile = (shader) => {
    shader.uniforms.evenLight = share;
    shader.fragmentShader = 'uniform float evenLight;\n' + shader.fragmentShader.replace(
      '#include <opaque_fragment>', 'outgoingLight = mix(outgoingLight, diffuseColor.rgb, evenLight);\n#include <opaque_fragment>');
  };
  return share;
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

// A mesh and its frames: { caption, detail, colour, faces, frames: [Float32Array] }.
class Panel {
  constructor(description, wireMaterial) {
    Object.assign(this, description);
    this.wireMaterial = wireMaterial;
    const first = this.frames[0];
    this.xyz = new Float32Array(first);
    this.normals = new Float32Array(first.length);
    this.colours = new Float32Array(first.length);
    this.geometry = new THREE.BufferGeometry();
    this.geometry.setAttribute('position', new THREE.BufferAttribute(this.xyz, 3));
    this.geometry.setAttribute('color', new THREE.BufferAttribute(this.colours, 3));
    this.object = new THREE.Group();
    if (this.faces.length > 0) {
      this.places = placesOf(first);
      this.geometry.setAttribute('normal', new THREE.BufferAttribute(this.normals, 3));
      this.geometry.setIndex(new THREE.BufferAttribute(this.faces, 1));
      this.material = new THREE.MeshStandardMaterial({
        vertexColors: true, roughness: 0.8, metalness: 0, side: THREE.DoubleSide, shadowSide: THREE.DoubleSide,
        polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
      });
      this.evenLight = lightEvenly(this.material);
      this.solid = new THREE.Mesh(this.geometry, this.material);
      this.solid.castShadow = this.solid.receiveShadow = true;
    } else {
      this.material = new THREE.PointsMaterial({ vertexColors: true, size: 3, sizeAttenuation: false });
      this.solid = new THREE.Points(this.geometry, this.material);
    }
    this.solid.frustumCulled = false;
    this.object.add(this.solid);
    this.box = new THREE.Box3();
    for (const frame of this.frames) this.box.union(new THREE.Box3().setFromArray(frame));
    this.shown = -1;
    this.show(0);
    this.paint(null);
  }
  show(frame) {
    frame = Math.min(frame, this.frames.length - 1);
    if (frame === this.shown) return;
    this.shown = frame;
    this.xyz.set(this.frames[frame]);
    this.geometry.attributes.position.needsUpdate = true;
    if (this.faces.length > 0) {
      setNormals(this.xyz, this.faces, this.places, this.normals);
      this.geometry.attributes.normal.needsUpdate = true;
    }
    this.geometry.boundingSphere = this.geometry.boundingBox = null;
  }
  // heat: { values: [V] in metres, high, table } or null
  paint(heat) {
    this.heat = heat;
    if (heat) {
      for (let v = 0; v < heat.values.length; ++v) {
        const t = Math.min(255, Math.round(255 * heat.values[v] / heat.high));
        for (let k = 0; k < 3; ++k) this.colours[3 * v + k] = heat.table[3 * t + k];
      }
    } else {
      const colour = new THREE.Color(this.colour);
      for (let v = 0; v < this.colours.length; v += 3) colour.toArray(this.colours, v);
    }
    if (this.evenLight) this.evenLight.value = heat ? 0.5 : 0;
    this.geometry.attributes.color.needsUpdate = true;
  }
  setWire(on) {
    if (on && !this.wire && this.faces.length > 0) {
      const lines = new THREE.BufferGeometry();
      lines.setAttribute('position', this.geometry.attributes.position);
      lines.setIndex(new THREE.BufferAttribute(edgesOf(this.faces), 1));
      this.wire = new THREE.LineSegments(lines, this.wireMaterial);
      this.wire.frustumCulled = false;
      this.object.add(this.wire);
    }
    if (this.wire) this.wire.visible = on;
  }
  // Seen through, for laying it over another.
  setGhost(on) {
    if (this.material.transparent === on) return;
    Object.assign(this.material, { transparent: on, opacity: on ? 0.45 : 1, depthWrite: !on });
    this.solid.castShadow = this.solid.receiveShadow = !on && this.faces.length > 0;
    this.material.needsUpdate = true;
  }
  dispose() {
    this.geometry.dispose();
    this.material.dispose();
    if (this.wire) this.wire.geometry.dispose();
  }
}

export class Studio {
  constructor({ canvas, stage, captions, calm }) {
    Object.assign(this, { canvas, stage, captions, panels: [], frame: 0, wire: false, overlay: false, dirty: true });
    this.table = heatTable();
    const renderer = this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = THREE.VSMShadowMap;
    renderer.autoClear = false;
    this.wireMaterial = new THREE.LineBasicMaterial({ color: 0x1c2126, transparent: true, opacity: 0.45 });

    const world = this.world = new THREE.Scene();
    this.holder = new THREE.Group();
    world.add(this.holder, new THREE.HemisphereLight(0xffffff, 0xcfc8be, 1.75));
    const key = this.key = new THREE.DirectionalLight(0xfff6ec, 1.9);
    key.castShadow = true;
    key.shadow.mapSize.set(1024, 1024);
    Object.assign(key.shadow, { radius: 6, blurSamples: 12, bias: -0.0006, normalBias: 0.016 });
    const rim = new THREE.DirectionalLight(0xe6eeff, 0.8);
    rim.position.set(1.6, 1.2, -2);
    world.add(key, key.target, rim);
    this.camera = new THREE.PerspectiveCamera(lens, 1, 0.01, 100);
    this.camera.add(new THREE.DirectionalLight(0xffffff, 0.35));
    world.add(this.camera);

    const plane = new THREE.PlaneGeometry(1, 1).rotateX(-Math.PI / 2);
    this.shadow = new THREE.Mesh(plane, new THREE.ShadowMaterial({ opacity: 0.2, depthWrite: false }));
    // It fades out before it meets the next panel.
    this.shadow.material.onBeforeCompile = (shader) => {
      shader.vertexShader = 'varying vec2 onGround;\n' + shader.vertexShader.replace(
        '#include <begin_vertex>', '#include <begin_vertex>\nonGround = position.xz;');
      shader.fragmentShader = 'varying vec2 onGround;\n' + shader.fragmentShader.replace(
        '#include <fog_fragment>', 'gl_FragColor.a *= 1.0 - smoothstep(0.04, 0.085, length(onGround));\n#include <fog_fragment>');
    };
    this.shadow.receiveShadow = true;
    this.floor = new THREE.Mesh(plane, new THREE.MeshBasicMaterial({ map: glow(), transparent: true, depthWrite: false }));
    this.floor.position.y = -0.002;
    this.floor.renderOrder = -2, this.shadow.renderOrder = -1;
    world.add(this.floor, this.shadow);

    const controls = this.controls = new THREE.OrbitControls(this.camera, canvas);
    controls.enableDamping = !calm;
    controls.dampingFactor = 0.12;
    controls.addEventListener('change', () => { this.dirty = true; });
    new ResizeObserver(() => {
      if (this.panels.length === 0) return;
      this.layCaptions();
      this.draw();
    }).observe(stage);
    // The picture is lost when the system takes the graphics memory away; three.js makes it anew.
    canvas.addEventListener('webglcontextrestored', () => { this.dirty = true; });
  }

  get frames() { return Math.max(1, ...this.panels.map((panel) => panel.frames.length)); }

  // Panels from the left; `aim`: whether the view begins anew.
  setPanels(descriptions, aim) {
    for (const panel of this.panels) panel.dispose();
    this.holder.clear();
    this.panels = descriptions.map((description) => new Panel(description, this.wireMaterial));
    this.place();
    for (const panel of this.panels) panel.setWire(this.wire);
    this.setFrame(0);
    if (aim) this.reset();
    this.layCaptions();
    this.dirty = true;
  }

  setCaptions(texts) {
    this.panels.forEach((panel, i) => Object.assign(panel, texts[i]));
    this.layCaptions();
  }

  // The figures on the ground, centred, at one scale; each at its own where they differ by more than threefold (other units).
  place() {
    const sizes = this.panels.map(({ box }) => {
      const size = box.getSize(new THREE.Vector3());
      return Math.max(size.x, size.y, size.z) || 1;
    });
    const common = Math.max(...sizes) < 3 * Math.min(...sizes);
    let width = 0, height = 0, across = 0;
    this.panels.forEach((panel, i) => {
      const scale = 1 / (common ? Math.max(...sizes) : sizes[i]);
      const centre = panel.box.getCenter(new THREE.Vector3()), size = panel.box.getSize(new THREE.Vector3());
      panel.root = new THREE.Group();
      panel.root.add(panel.object);
      panel.root.scale.setScalar(scale);
      panel.root.position.set(-centre.x * scale, -panel.box.min.y * scale, -centre.z * scale);
      this.holder.add(panel.root);
      const yaw = firstView.yaw * Math.PI / 180;
      width = Math.max(width, scale * (size.x * Math.cos(yaw) + size.z * Math.sin(yaw)));
      across = Math.max(across, scale * Math.hypot(size.x, size.z));
      height = Math.max(height, size.y * scale);
    });
    this.extent = { width, height, radius: 0.5 * Math.hypot(across, height) };
    const r = this.extent.radius;
    this.floor.scale.setScalar(7 * r), this.shadow.scale.setScalar(12 * r);
    this.key.target.position.set(0, height / 2, 0);
    this.key.position.set(-0.75, 2.5, 1.25).multiplyScalar(2 * r).add(this.key.target.position);
    Object.assign(this.key.shadow.camera, { left: -1.7 * r, right: 1.7 * r, top: 1.7 * r, bottom: -1.7 * r, near: 0.1 * r, far: 12 * r });
    this.key.shadow.camera.updateProjectionMatrix();
  }

  // Columns such that figures come out largest.
  cells() {
    const width = this.stage.clientWidth, height = this.stage.clientHeight, count = this.panels.length, { extent } = this;
    let best = { columns: 1, rows: count, size: 0 };
    for (let columns = 1; columns <= count; ++columns) {
      const rows = Math.ceil(count / columns);
      const size = Math.min(width / columns / extent.width, (height / rows - 48) / extent.height);
      if (size > best.size * 1.02) best = { columns, rows, size };
    }
    const { columns, rows } = best;
    return this.panels.map((_, i) => ({
      x: (i % columns) * width / columns, y: Math.floor(i / columns) * height / rows, width: width / columns, height: height / rows,
    }));
  }

  // The camera for a cell: the figure stands above the caption, the ground goes on below it.
  aim(cell) {
    const caption = cell.height > 150 ? 48 : 0;
    this.camera.aspect = cell.width / cell.height;
    this.camera.setViewOffset(cell.width, cell.height, 0, caption / 2, cell.width, cell.height);
  }

  reset() { this.lookFrom(firstView.yaw, firstView.pitch); }
  lookFrom(yaw, pitch) {
    if (this.panels.length === 0) return;
    const cell = this.cells()[0], { extent, camera, controls } = this;
    const free = (cell.height - (cell.height > 150 ? 48 : 0)) / cell.height;
    const half = Math.tan(lens * Math.PI / 360);
    const tall = extent.height / free, wide = extent.width * cell.height / cell.width;
    const distance = 0.5 * Math.max(tall, wide) * 1.08 / half + 0.25 * extent.radius;
    controls.target.set(0, extent.height * 0.49, 0);
    const y = yaw * Math.PI / 180, p = pitch * Math.PI / 180;
    camera.position.set(Math.sin(y) * Math.cos(p), Math.sin(p), Math.cos(y) * Math.cos(p)).multiplyScalar(distance).add(controls.target);
    camera.near = extent.radius * 0.02, camera.far = distance + extent.radius * 40;
    controls.minDistance = extent.radius * 0.1, controls.maxDistance = distance * 6;
    controls.update();
    this.dirty = true;
  }

  // Turns by degrees, or comes nearer by a factor, as the mouse does.
  turn(yaw, pitch, factor) {
    const { camera, controls } = this;
    const offset = camera.position.clone().sub(controls.target);
    const length = offset.length() * factor;
    const angle = Math.atan2(offset.x, offset.z) + yaw * Math.PI / 180;
    const lift = Math.max(-1.5, Math.min(1.5, Math.asin(offset.y / offset.length()) + pitch * Math.PI / 180));
    offset.set(Math.sin(angle) * Math.cos(lift), Math.sin(lift), Math.cos(angle) * Math.cos(lift));
    camera.position.copy(controls.target).addScaledVector(offset, length);
    controls.update();
    this.dirty = true;
  }

  setFrame(frame) {
    this.frame = frame;
    for (const panel of this.panels) panel.show(frame);
    this.dirty = true;
  }
  setWire(on) {
    this.wire = on;
    for (const panel of this.panels) panel.setWire(on);
    this.dirty = true;
  }
  setOverlay(on) {
    this.overlay = on;
    this.dirty = true;
  }
  setHeat(values, high) {
    const result = this.panels[2];
    if (result) result.paint(values ? { values, high, table: this.table } : null);
    this.dirty = true;
  }
  setTheme(dark) {
    this.wireMaterial.color.set(dark ? 0x0b0d10 : 0x1c2126);
    this.floor.material.color.set(dark ? 0x50585f : 0xffffff);
    this.floor.material.opacity = dark ? 0.55 : 0.9;
    this.shadow.material.opacity = dark ? 0.5 : 0.24;
    this.dirty = true;
  }

  draw() {
    const { renderer } = this, width = this.stage.clientWidth, height = this.stage.clientHeight;
    if (width === 0 || height === 0) return;
    renderer.setSize(width, height, false);
    renderer.setScissorTest(false);
    renderer.clear();
    renderer.setScissorTest(true);
    this.cells().forEach((cell, i) => {
      const over = this.overlay && i === 2;
      this.panels.forEach((panel, k) => {
        panel.root.visible = k === i || (over && k === 1);
        panel.setGhost(over && k === 1);
      });
      renderer.setViewport(cell.x, height - cell.y - cell.height, cell.width, cell.height);
      renderer.setScissor(cell.x, height - cell.y - cell.height, cell.width, cell.height);
      this.aim(cell);
      renderer.render(this.world, this.camera);
    });
  }
  tick() {
    this.controls.update();
    if (!this.dirty || this.panels.length === 0) return;
    this.dirty = false;
    this.draw();
  }

  layCaptions() {
    this.captions.replaceChildren();
    this.cells().forEach((cell, i) => {
      const { caption, detail } = this.panels[i];
      const line = document.createElement('p');
      line.textContent = caption;
      if (detail) {
        const small = document.createElement('small');
        small.textContent = detail;
        line.append(small);
      }
      Object.assign(line.style, { left: `${cell.x}px`, width: `${cell.width}px`, top: `${cell.y + cell.height - 5}px` });
      this.captions.append(line);
    });
  }

  // The value under a point of the stage, of the colours of the result; else null.
  valueAt(x, y) {
    const panel = this.panels[2], cell = this.cells()[2];
    if (!panel || !panel.heat || !cell) return null;
    if (x < cell.x || x >= cell.x + cell.width || y < cell.y || y >= cell.y + cell.height) return null;
    this.aim(cell);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * (x - cell.x) / cell.width - 1, 1 - 2 * (y - cell.y) / cell.height), this.camera);
    const hit = ray.intersectObject(panel.solid)[0];
    if (!hit || !hit.face) return null;
    return Math.max(...[hit.face.a, hit.face.b, hit.face.c].map((v) => panel.heat.values[v]));
  }
}
