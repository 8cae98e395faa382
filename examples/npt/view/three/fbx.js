// FBX files as GLB, for the page: three.js' loader and exporter. bundle.sh makes fbx.min.js of it, which is fetched when
// an FBX file is dropped.
import { Group, LoadingManager, MeshStandardMaterial } from 'three';
import { FBXLoader } from 'three/addons/loaders/FBXLoader.js';
import { GLTFExporter } from 'three/addons/exporters/GLTFExporter.js';

// Names as the file has them: three.js takes out what its own paths use, such as the colon of "mixamorig:Hips".
const ownNames = () => ({
  writeNode(object, node) {
    const own = object.userData.originalName;
    if (own !== undefined) node.name = own;
    delete node.extras;
  },
});

// Images that the file names, by the name alone: people's files hold paths of another machine.
function imagesOf(others, missing) {
  const urls = new Map();
  for (const [name, bytes] of Object.entries(others))
    urls.set(name.split(/[\\/]/).at(-1).toLowerCase(), URL.createObjectURL(new Blob([bytes])));
  const urlOf = (url) => {
    if (/^(blob|data):/.test(url)) return url;
    const name = decodeURIComponent(url).split(/[\\/]/).at(-1);
    const own = urls.get(name.toLowerCase());
    if (own === undefined) missing.add(name);
    return own ?? 'data:,';
  };
  return { urlOf, release: () => urls.forEach((url) => URL.revokeObjectURL(url)) };
}

// What glTF has of a material; without images that are not there.
function plain(material) {
  const there = (texture) => (texture?.image?.width > 0 ? texture : null);
  const { name, color, opacity, transparent, alphaTest, side, vertexColors } = material;
  return new MeshStandardMaterial({ name, color, opacity, transparent, alphaTest, side, vertexColors, metalness: 0, roughness: 1,
    map: there(material.map), normalMap: there(material.normalMap), emissiveMap: there(material.emissiveMap), emissive: material.emissive });
}

function keepFigures(object) {
  const others = [];
  object.traverse((one) => {
    if (one.isLight || one.isCamera) others.push(one);
    if (one.isMesh) one.material = Array.isArray(one.material) ? one.material.map(plain) : plain(one.material);
  });
  for (const one of others) if (one.children.length === 0) one.removeFromParent();
}

/** { bytes, missing }: a GLB in metres with y up, and the images that the file names and `others`, by their names, lack. */
export async function glbOf(bytes, others = {}) {
  const missing = new Set(), images = imagesOf(others, missing), manager = new LoadingManager();
  manager.setURLModifier(images.urlOf);
  try {
    const loaded = new Promise((done) => { manager.onLoad = done; });
    manager.itemStart('file');
    const loader = new FBXLoader(manager);
    loader.trimAnimationClips = true;
    const object = loader.parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), '');
    manager.itemEnd('file');
    await loaded;
    keepFigures(object);
    const scene = new Group();
    scene.scale.setScalar(0.01 * (object.userData.unitScaleFactor ?? 1));  // units are centimetres, or so many of them
    scene.add(object);
    const glb = await new GLTFExporter().register(ownNames)
      .parseAsync(scene, { binary: true, onlyVisible: false, animations: object.animations.filter((clip) => clip.tracks.length > 0) });
    return { bytes: new Uint8Array(glb), missing: [...missing] };
  } finally {
    images.release();
  }
}
