// Clips as three.js plays them: node play_three.js THREE.min.js FILE.glb ...; beside each file NAME.json says where its joints are.
const fs = require('fs');

const THREE = new Function(`${fs.readFileSync(process.argv[2], 'utf8')}; return THREE;`)();

// The file's bytes without its materials, whose pictures only a browser decodes.
function withoutMaterials(file) {
  const bytes = fs.readFileSync(file), end = 20 + bytes.readUInt32LE(12);
  const json = JSON.parse(bytes.toString('utf8', 20, end));
  for (const key of ['materials', 'textures', 'images', 'samplers']) delete json[key];
  for (const mesh of json.meshes || []) for (const primitive of mesh.primitives) delete primitive.material;
  const text = Buffer.from(JSON.stringify(json)), blanks = Buffer.alloc((4 - text.length % 4) % 4, ' ');
  const whole = Buffer.concat([bytes.subarray(0, 20), text, blanks, bytes.subarray(end)]);
  whole.writeUInt32LE(whole.length, 8);
  whole.writeUInt32LE(text.length + blanks.length, 12);
  return whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length);
}

// How far the joints are off at most, as a part of the skeleton's size.
function farthest(gltf, played) {
  const objects = new Map();
  for (const [object, of] of gltf.parser.associations)
    if (of?.nodes !== undefined && of.primitives === undefined) objects.set(of.nodes, object);
  const mixer = new THREE.AnimationMixer(gltf.scene);
  if (played.clip !== null) {
    const action = mixer.clipAction(gltf.animations.find(clip => clip.name === played.clip));
    action.clampWhenFinished = true;
    action.setLoop(2200, 1).play();  // LoopOnce
  }
  let most = 0;
  const all = played.places.flat(), size = Math.max(...[0, 1, 2].map(axis => {
    const values = all.map(place => place[axis]);
    return Math.max(...values) - Math.min(...values);
  }));
  played.times.forEach((time, t) => {
    mixer.setTime(time);
    gltf.scene.updateMatrixWorld(true);
    played.joints.forEach((joint, j) => {
      const place = objects.get(joint.node).matrixWorld.elements.slice(12, 15);
      most = Math.max(most, Math.hypot(...place.map((value, axis) => value - played.places[t][j][axis])));
    });
  });
  mixer.stopAllAction();
  return most / size;
}

(async () => {
  let good = process.argv.length > 3;
  for (const file of process.argv.slice(3)) {
    const gltf = await new Promise((resolve, reject) => new THREE.GLTFLoader().parse(withoutMaterials(file), '', resolve, reject));
    for (const played of JSON.parse(fs.readFileSync(file.replace(/glb$/, 'json'), 'utf8'))) {
      const off = farthest(gltf, played);
      console.log(`${file}: ${played.clip === null ? 'at rest' : played.clip}: ${played.joints.length} joints, ` +
                  `${played.times.length} times, off by ${off.toExponential(1)} of their size`);
      good = good && off < 1e-5;  // keys are floats
    }
  }
  process.exit(good ? 0 : 1);
})();
