// The robot on its ground. Axes as in the simulation: x ahead, y to the left, z up.
import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Fog, Group,
  Mesh, MeshLambertMaterial, MeshStandardMaterial, PCFShadowMap, PerspectiveCamera, Scene,
  SphereGeometry, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const DARK_FOOT = "#464b52";
const LOW = new Color("#968878"), MIDDLE = new Color("#cdc2b2"), HIGH = new Color("#f2ece2");

export function scene(holder, data) {
  let renderer;
  try {
    renderer = new WebGLRenderer({ antialias: true });
  } catch (error) {
    holder.textContent = "This browser has no WebGL, so the robot cannot be shown; the charts still tell of it.";
    return { show() {}, render() {}, follow() {}, recolour() {}, position: () => null };
  }
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFShadowMap;
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  holder.append(renderer.domElement);

  const world = new Scene();
  const camera = new PerspectiveCamera(40, 16 / 9, 0.05, 60);
  camera.up.set(0, 0, 1);
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.enableDamping = false;
  controls.maxPolarAngle = 1.5;
  world.add(new AmbientLight("#ffffff", 1.3));
  const sun = new DirectionalLight("#fff6e6", 2.2);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  Object.assign(sun.shadow.camera, { left: -2, right: 2, top: 2, bottom: -2, near: 0.5, far: 12 });
  world.add(sun, sun.target);
  world.add(ground(data.ground));

  const bodies = data.bodies.map((body) => {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(body.vertices, 3));
    geometry.setAttribute("color", new BufferAttribute(body.colours, 3, true));
    geometry.setIndex(new BufferAttribute(body.faces, 1));
    const flat = geometry.toNonIndexed();
    flat.computeVertexNormals();
    const mesh = new Mesh(flat, new MeshStandardMaterial({ vertexColors: true, roughness: 0.55, metalness: 0.1 }));
    mesh.castShadow = true;
    world.add(mesh);
    return mesh;
  });
  const ball = new SphereGeometry(1.3 * data.footRadius, 16, 12);
  const feet = [0, 1, 2, 3].map(() => {
    const mesh = new Mesh(ball, new MeshLambertMaterial());
    world.add(mesh);
    return mesh;
  });
  const plane = new Mesh(
    new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(12), 3)),
    new MeshLambertMaterial({ color: "#0072b2", transparent: true, opacity: 0.28, side: DoubleSide, depthWrite: false }),
  );
  plane.geometry.setIndex([0, 1, 2, 0, 2, 3]);
  plane.frustumCulled = false;
  world.add(plane);

  const middle = new Vector3();
  let follows = true;
  let first = true;
  let drawn = [0, 0];

  function recolour() {
    const style = getComputedStyle(document.documentElement);
    const sky = new Color(style.getPropertyValue("--sky").trim());
    world.background = sky;
    world.fog = new Fog(sky, 7, 22);
    render();
  }

  function show(entry) {
    const i = Math.min(Math.floor(entry / data.every), data.frames - 1);
    const count = bodies.length;
    bodies.forEach((mesh, b) => {
      const p = 3 * (i * count + b), q = 4 * (i * count + b);
      mesh.position.fromArray(data.position, p);
      mesh.quaternion.set(data.rotation[q + 1], data.rotation[q + 2], data.rotation[q + 3], data.rotation[q]);
    });
    const gait = data.gaits[data.gait[entry]].colour;
    feet.forEach((mesh, leg) => {
      mesh.position.fromArray(data.feet, 3 * (4 * i + leg));
      mesh.material.color.set((data.contact[entry] >> leg) & 1 ? gait : DARK_FOOT);
    });
    const corners = plane.geometry.attributes.position;
    corners.array.set(data.plane.subarray(12 * i, 12 * i + 12));
    corners.needsUpdate = true;
    plane.geometry.computeVertexNormals();
    plane.visible = Number.isFinite(corners.array[0]);
    const base = bodies[0].position;
    if (first) {
      camera.position.set(base.x - 1.3, base.y - 2.3, base.z + 0.75);
      middle.set(base.x, base.y, base.z - 0.15);
      controls.target.copy(middle);
      first = false;
    }
    if (follows) {
      const to = new Vector3(base.x, base.y, middle.z + 0.1 * (base.z - 0.15 - middle.z));
      const move = to.clone().sub(middle);
      camera.position.add(move);
      controls.target.add(move);
      middle.copy(to);
    }
    sun.position.set(base.x + 2, base.y - 2.6, base.z + 5);
    sun.target.position.copy(base);
    render();
  }

  function render() {
    const wide = holder.clientWidth, high = holder.clientHeight;
    if (drawn[0] !== wide || drawn[1] !== high) {
      drawn = [wide, high];
      renderer.setSize(wide, high, false);
      camera.aspect = wide / high;
      camera.updateProjectionMatrix();
    }
    controls.update();
    renderer.render(world, camera);
  }

  function follow(is) {
    follows = is;
    if (is) middle.copy(bodies[0].position).setZ(bodies[0].position.z - 0.15);
    if (is) {
      const move = middle.clone().sub(controls.target);
      camera.position.add(move);
      controls.target.add(move);
    }
  }

  recolour();
  return { show, render, follow, recolour, position: () => bodies[0].position.toArray() };
}

function ground({ rows, columns, x, y, height }) {
  const count = rows * columns;
  const position = new Float32Array(3 * count), colour = new Float32Array(3 * count);
  let reach = 0.05;
  for (const h of height) reach = Math.max(reach, Math.abs(h));
  const paint = new Color();
  for (let r = 0, v = 0; r < rows; r++)
    for (let c = 0; c < columns; c++, v++) {
      const h = height[v], px = x[0] + c * x[1], py = y[0] + r * y[1];
      position.set([px, py, h], 3 * v);
      const share = h / reach;
      paint.copy(MIDDLE).lerp(share < 0 ? LOW : HIGH, Math.min(Math.abs(share), 1));
      if ((Math.floor(px + 1e-6) + Math.floor(py + 1e-6)) & 1) paint.multiplyScalar(0.93);
      colour.set([paint.r, paint.g, paint.b], 3 * v);
    }
  const index = new Uint32Array(6 * (rows - 1) * (columns - 1));
  for (let r = 0, k = 0; r < rows - 1; r++)
    for (let c = 0; c < columns - 1; c++) {
      const a = r * columns + c, b = a + 1, d = a + columns, e = d + 1;
      index.set([a, b, e, a, e, d], k);
      k += 6;
    }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(position, 3));
  geometry.setAttribute("color", new BufferAttribute(colour, 3));
  geometry.setIndex(new BufferAttribute(index, 1));
  geometry.computeVertexNormals();
  const mesh = new Mesh(geometry, new MeshLambertMaterial({ vertexColors: true }));
  mesh.receiveShadow = true;
  const group = new Group();
  group.add(mesh);
  return group;
}
