// The parts of three.js that a report uses; `npm run build` makes ../three.min.js of them.
export {
  BufferAttribute, BufferGeometry, Box3, Color, ColorManagement, ConeGeometry, CylinderGeometry,
  DataTexture, DoubleSide, InstancedMesh, LinearFilter, LinearSRGBColorSpace, LineSegments, Matrix4,
  Mesh, MeshBasicMaterial, MOUSE, OrthographicCamera, Quaternion, Scene, ShaderMaterial, TOUCH,
  Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
