// What the view uses of three.js, for three.iife.min.js:
//   npm install three@0.187.0 esbuild@0.28.2
//   npx esbuild three.entry.mjs --bundle --minify --format=iife --global-name=THREE --outfile=three.iife.min.js
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
export {
  BufferGeometry, CanvasTexture, Color, ConeGeometry, CylinderGeometry, DirectionalLight, Float32BufferAttribute,
  Fog, GridHelper, Group, HemisphereLight, LineBasicMaterial, LineDashedMaterial, LineSegments, Mesh,
  MeshBasicMaterial, MeshStandardMaterial, PCFShadowMap, PerspectiveCamera, PlaneGeometry, RingGeometry, Scene,
  SphereGeometry, SRGBColorSpace, Vector3, WebGLRenderer,
} from "three";
