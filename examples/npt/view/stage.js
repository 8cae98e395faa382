// Meshes beside each other on one canvas with one camera: what the pages of npt view and of the browser demo (examples/web/page) share, on
// elements that both name alike. A classic script, whose global is npt; three.js stands in the global THREE before a stage is made.
'use strict';

const npt = (() => {
  const element = (id) => document.getElementById(id);
  const calm = matchMedia('(prefers-reduced-motion: reduce)').matches;
  const lens = 24;  // degrees, as a portrait's
  const firstView = { yaw: 28, pitch: 8 };

  // ---- what a panel shows ----

  // Vertices in one place are one for the light: seams of textures don't show.
  function placesOf(positions) {
    const seen = new Map();
    const places = new Uint32Array(positions.length / 3);
    let shared = false;
    for (let v = 0; v < places.length; ++v) {
      const key = `${positions[3 * v]},${positions[3 * v + 1]},${positions[3 * v + 2]}`;
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

  // 256 colours, linear, by way of these, which are the legend's.
  function heatTable(colours) {
    element('legend-bar').style.background = `linear-gradient(90deg, ${colours.join(', ')})`;
    const table = new Float32Array(3 * 256), stops = colours.map((text) => new THREE.Color(text));
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
        '#include <opaque_fragment>',
        'outgoingLight = mix(outgoingLight, diffuseColor.rgb, evenLight);\n#include <opaque_fragment>');
    };
    return share;
  }

  // A mesh: { caption, detail, colour }. Who extends it gives setMesh() its faces, writes xyz, then calls moved().
  class MeshPanel {
    constructor(description) { Object.assign(this, description); }

    // `positions`: of one frame, in numbers of any kind; `inner` as for edgesOf().
    setMesh(positions, faces, inner = null) {
      this.faces = faces;
      this.inner = inner;
      this.places = placesOf(positions);
      for (const name of ['xyz', 'normals', 'colours']) this[name] = new Float32Array(positions.length);
      this.geometry = new THREE.BufferGeometry();
      this.geometry.setAttribute('position', new THREE.BufferAttribute(this.xyz, 3));
      this.geometry.setAttribute('color', new THREE.BufferAttribute(this.colours, 3));
      if (faces.length > 0) {
        this.geometry.setAttribute('normal', new THREE.BufferAttribute(this.normals, 3));
        this.geometry.setIndex(new THREE.BufferAttribute(faces, 1));
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
      this.object = new THREE.Group();
      this.object.add(this.solid);
    }

    moved() {
      this.geometry.attributes.position.needsUpdate = true;
      if (this.faces.length > 0) {
        setNormals(this.xyz, this.faces, this.places, this.normals);
        this.geometry.attributes.normal.needsUpdate = true;
      }
      this.geometry.boundingSphere = this.geometry.boundingBox = null;
    }

    // heat: { values: [V], unit: of a value, in millimetres, high: millimetres of the last colour, table } or null
    paint(heat) {
      this.heat = heat;
      if (heat) {
        const scale = heat.unit / heat.high;
        for (let v = 0; v < heat.values.length; ++v) {
          const t = Math.min(255, Math.round(255 * heat.values[v] * scale));
          for (let k = 0; k < 3; ++k) this.colours[3 * v + k] = heat.table[3 * t + k];
        }
      } else {
        this.paintPlain();
      }
      if (this.evenLight) this.evenLight.value = heat ? 0.5 : 0;
      this.geometry.attributes.color.needsUpdate = true;
    }
    paintPlain() {
      const colour = new THREE.Color(this.colour);
      for (let v = 0; v < this.colours.length; v += 3) colour.toArray(this.colours, v);
    }

    setWire(on, material) {
      if (on && !this.wire && this.faces.length > 0) {
        const lines = new THREE.BufferGeometry();
        lines.setAttribute('position', this.geometry.attributes.position);
        lines.setIndex(new THREE.BufferAttribute(edgesOf(this.faces, this.inner), 1));
        this.wire = new THREE.LineSegments(lines, material);
        this.wire.frustumCulled = false;
        this.object.add(this.wire);
      }
      if (this.wire) this.wire.visible = on;
    }

    dispose() {
      this.geometry.dispose();
      this.material.dispose();
      if (this.wire) this.wire.geometry.dispose();
    }
  }

  // ---- the stage ----

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

  // The part of a cell below the figure.
  const captionHeight = (cell) => (cell.height > 150 ? 48 : 0);

  const millimetres = (x) => `${x < 10 ? x.toFixed(1) : Math.round(x)} mm`;

  // Panels are { caption, detail, object, box, frames, setWire(on, material), dispose() }; one with .heat, as MeshPanel has it, can be read.
  class Stage {
    // `fade`: from where to where a shadow fades out, as a share of the ground.
    constructor({ fade }) {
      Object.assign(this, { box: element('stage'), canvas: element('canvas'), panels: [], wire: false, dirty: true });
      const renderer = this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true });
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
          '#include <fog_fragment>',
          `gl_FragColor.a *= 1.0 - smoothstep(${fade[0]}, ${fade[1]}, length(onGround));\n#include <fog_fragment>`);
      };
      this.shadow.receiveShadow = true;
      this.floor = new THREE.Mesh(plane, new THREE.MeshBasicMaterial({ map: glow(), transparent: true, depthWrite: false }));
      this.floor.position.y = -0.002;
      this.floor.renderOrder = -2, this.shadow.renderOrder = -1;
      world.add(this.floor, this.shadow);

      const controls = this.controls = new THREE.OrbitControls(this.camera, this.canvas);
      controls.enableDamping = !calm;
      controls.dampingFactor = 0.12;
      controls.addEventListener('change', () => this.redraw());
      this.canvas.addEventListener('pointermove', (event) => this.read(event));
      this.canvas.addEventListener('pointerleave', () => { element('reading').hidden = true; });
      new ResizeObserver(() => {
        if (this.panels.length === 0) return;
        this.layCaptions();
        this.draw();
      }).observe(this.box);
      // The picture is lost when the system takes the graphics memory away; three.js makes it anew.
      this.canvas.addEventListener('webglcontextrestored', () => this.redraw());
      theme.stage = this;
      theme.set();
    }

    redraw() { this.dirty = true; }
    get frames() { return Math.max(1, ...this.panels.map((panel) => panel.frames)); }

    clear() {
      this.holder.clear();
      for (const panel of this.panels) panel.dispose();
      this.panels = [];
    }

    // Panels from the left.
    setPanels(panels) {
      this.clear();
      this.panels = panels;
      this.place();
      this.setWire(this.wire);
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
      const { key } = this, r = this.extent.radius;
      this.floor.scale.setScalar(7 * r), this.shadow.scale.setScalar(12 * r);
      key.target.position.set(0, height / 2, 0);
      key.position.set(-0.75, 2.5, 1.25).multiplyScalar(2 * r).add(key.target.position);
      Object.assign(key.shadow.camera, { left: -1.7 * r, right: 1.7 * r, top: 1.7 * r, bottom: -1.7 * r, near: 0.1 * r, far: 12 * r });
      key.shadow.camera.updateProjectionMatrix();
    }

    // Columns such that figures come out largest.
    cells() {
      const { clientWidth: width, clientHeight: height } = this.box, { extent } = this, count = this.panels.length;
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
      this.camera.aspect = cell.width / cell.height;
      this.camera.setViewOffset(cell.width, cell.height, 0, captionHeight(cell) / 2, cell.width, cell.height);
    }

    reset() { this.lookFrom(firstView.yaw, firstView.pitch); }
    lookFrom(yaw, pitch) {
      if (this.panels.length === 0) return;
      const cell = this.cells()[0], { extent, camera, controls } = this;
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
      this.redraw();
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
      this.redraw();
    }

    setWire(on) {
      this.wire = on;
      element('wire').setAttribute('aria-pressed', on);
      for (const panel of this.panels) panel.setWire(on, this.wireMaterial);
      this.redraw();
    }

    setTheme(dark) {
      this.wireMaterial.color.set(dark ? 0x0b0d10 : 0x1c2126);
      this.floor.material.color.set(dark ? 0x50585f : 0xffffff);
      this.floor.material.opacity = dark ? 0.55 : 0.9;
      this.shadow.material.opacity = dark ? 0.5 : 0.24;
      this.redraw();
    }

    // What the cell shows of the panels.
    setShown(cell) { this.panels.forEach((panel, i) => { panel.root.visible = i === cell; }); }

    draw() {
      const { renderer } = this, { clientWidth: width, clientHeight: height } = this.box;
      if (width === 0 || height === 0) return;
      renderer.setSize(width, height, false);
      renderer.setScissorTest(false);
      renderer.clear();
      renderer.setScissorTest(true);
      this.cells().forEach((cell, i) => {
        this.setShown(i);
        renderer.setViewport(cell.x, height - cell.y - cell.height, cell.width, cell.height);
        renderer.setScissor(cell.x, height - cell.y - cell.height, cell.width, cell.height);
        this.aim(cell);
        renderer.render(this.world, this.camera);
      });
    }
    tick() {
      if (this.panels.length === 0) return;
      this.controls.update();
      if (!this.dirty) return;
      this.dirty = false;
      this.draw();
    }

    layCaptions() {
      const lines = this.cells().map((cell, i) => {
        const { caption, detail } = this.panels[i], line = document.createElement('p');
        line.textContent = caption;
        if (detail) line.append(Object.assign(document.createElement('small'), { textContent: detail }));
        Object.assign(line.style, { left: `${cell.x}px`, width: `${cell.width}px`, top: `${cell.y + cell.height - 5}px` });
        return line;
      });
      element('captions').replaceChildren(...lines);
    }

    // Millimetres under a point of the canvas, where a panel is painted by them; else null.
    errorAt(x, y) {
      const cells = this.cells();
      const i = cells.findIndex((c) => x >= c.x && x < c.x + c.width && y >= c.y && y < c.y + c.height);
      const heat = this.panels[i]?.heat, cell = cells[i];
      if (!heat) return null;
      this.aim(cell);
      const ray = new THREE.Raycaster();
      ray.setFromCamera(new THREE.Vector2(2 * (x - cell.x) / cell.width - 1, 1 - 2 * (y - cell.y) / cell.height), this.camera);
      const face = ray.intersectObject(this.panels[i].solid)[0]?.face;
      return face ? Math.max(heat.values[face.a], heat.values[face.b], heat.values[face.c]) * heat.unit : null;
    }
    read(event) {
      const { left, top } = this.canvas.getBoundingClientRect(), x = event.clientX - left, y = event.clientY - top;
      const error = event.buttons === 0 ? this.errorAt(x, y) : null, output = element('reading');
      output.hidden = error === null;
      if (error === null) return;
      output.textContent = millimetres(error);
      Object.assign(output.style, { left: `${x}px`, top: `${y}px` });
    }
  }

  // ---- frames ----

  // The time that is shown, in seconds, and its controls.
  class Player {
    // fps() in frames a second; show(time, frame) is called for each new time; speed() is 1 unless given.
    constructor({ fps, show, speed = () => 1 }) {
      Object.assign(this, { fps, show, speed, frames: 1, frame: 0, time: 0, playing: false, before: 0 });
      element('play').onclick = () => this.toggle();
      element('time').oninput = () => this.seek(Number(element('time').value));
    }

    setFrames(frames) {
      this.frames = frames;
      element('player').hidden = frames < 2;
      element('time').max = frames - 1;
    }
    setTime(time) {
      this.time = time;
      this.frame = Math.min(this.frames - 1, Math.floor(time * this.fps() + 1e-6));
      element('time').value = this.frame;
      element('frame').textContent = `${this.frame + 1} / ${this.frames}`;
      this.show(time, this.frame);
    }
    setFrame(frame) { this.setTime((Math.max(0, Math.min(this.frames - 1, frame)) + 1e-3) / this.fps()); }
    // By hand, which stops it.
    seek(frame) {
      this.setPlaying(false);
      this.setFrame(frame);
    }

    setPlaying(on) {
      this.playing = on && this.frames > 1;
      element('play').classList.toggle('playing', this.playing);
      element('play').setAttribute('aria-label', this.playing ? 'Pause' : 'Play');
      this.before = performance.now();
    }
    toggle() { this.setPlaying(!this.playing); }
    tick(now) {
      if (this.playing && this.frames > 1) {
        // A frame's time may lie before the press of the button.
        const passed = Math.max(0, Math.min(0.25, (now - this.before) / 1000)) * this.speed();
        this.setTime((this.time + passed) % (this.frames / this.fps()));
      }
      this.before = now;
    }
  }

  // ---- buttons and keys ----

  // Dark or light: as the system has it, until the button is pressed.
  const theme = {
    system: matchMedia('(prefers-color-scheme: dark)'), chosen: null, stage: null,
    set() {
      const name = theme.chosen ?? (theme.system.matches ? 'dark' : 'light');
      document.documentElement.dataset.theme = name;
      element('theme').textContent = name === 'dark' ? 'Light' : 'Dark';
      theme.stage?.setTheme(name === 'dark');
    },
    toggle() {
      theme.chosen = document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark';
      theme.set();
    },
    follow() {
      theme.system.addEventListener('change', theme.set);
      theme.set();
    },
  };

  // `more`: keys of the page's own; `kept`: by kinds of controls, other keys that they keep for themselves.
  function listen(stage, player, more, kept = {}) {
    const buttons = {
      front: () => stage.lookFrom(0, 4), side: () => stage.lookFrom(90, 4), back: () => stage.lookFrom(180, 4), reset: () => stage.reset(),
      wire: () => stage.setWire(!stage.wire), theme: theme.toggle, help: () => element('keys').showModal(),
    };
    for (const [id, action] of Object.entries(buttons)) element(id).onclick = action;
    const keys = {
      ' ': () => player.toggle(), ',': () => player.seek(player.frame - 1), '.': () => player.seek(player.frame + 1),
      ArrowLeft: () => stage.turn(-10, 0, 1), ArrowRight: () => stage.turn(10, 0, 1),
      ArrowUp: () => stage.turn(0, 10, 1), ArrowDown: () => stage.turn(0, -10, 1),
      '+': () => stage.turn(0, 0, 0.9), '=': () => stage.turn(0, 0, 0.9), '-': () => stage.turn(0, 0, 1 / 0.9),
      1: buttons.front, 2: buttons.side, 3: buttons.back, r: buttons.reset, w: buttons.wire, d: buttons.theme, '?': buttons.help, ...more,
    };
    const own = { SELECT: /^(Arrow|Home|End| |.$)/, INPUT: /^(Arrow|Home|End)/, BUTTON: /^ $/, ...kept };
    addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || element('keys').open) return;
      if (own[event.target.tagName]?.test(event.key)) return;
      const action = keys[event.key] ?? keys[event.key.toLowerCase()];
      if (!action) return;
      event.preventDefault();
      action();
    });
  }

  function run(stage, player) {
    requestAnimationFrame(function tick(now) {
      requestAnimationFrame(tick);
      player.tick(now);
      stage.tick();
    });
  }

  return { MeshPanel, Player, Stage, calm, element, heatTable, listen, run, theme };
})();
