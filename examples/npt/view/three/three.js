// What the page uses of three.js; bundle.sh makes three.min.js of it.
export {
  AmbientLight, AnimationMixer, Box3, BufferAttribute, BufferGeometry, CanvasTexture, Color, DirectionalLight,
  DoubleSide, Group, HemisphereLight, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshStandardMaterial,
  PCFShadowMap, PerspectiveCamera, PlaneGeometry, Points, PointsMaterial, Raycaster, SRGBColorSpace, Scene,
  ShadowMaterial, Vector2, Vector3, VSMShadowMap, WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
export { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
