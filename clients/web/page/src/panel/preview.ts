// SPDX-License-Identifier: MIT
// Picture of a mesh that is to become cloth, with its pins, its limits and the figure that wears it. It can be turned, and
// finds the place under the pointer.

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { hueOf, largestOf } from "./limit_colours";
import { boundsOf, sizeOf, within } from "./pins";

const kFieldOfView = 30; // degrees
const kMargin = 1.08;
const kMaxEdges = 60_000; // triangles of a mesh whose edges are drawn
const kPinSize = 7; // pixels
const kTurnStep = Math.PI / 24;
const kZoomStep = 1.15;

// Place under the pointer, in units of the file.
export interface Touched {
  point: THREE.Vector3;
  // The nearest corner of the triangle, and vertices in the same place. Empty next to the mesh.
  corner: readonly number[];
}

export class Preview {
  readonly orbit: OrbitControls;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(kFieldOfView);
  private readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  private readonly edges: THREE.LineSegments<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  private readonly pins: THREE.Points<THREE.BufferGeometry, THREE.PointsMaterial>;
  private readonly figure: THREE.Mesh<THREE.BufferGeometry, THREE.MeshStandardMaterial>;
  private readonly brush: THREE.Mesh<THREE.SphereGeometry, THREE.MeshBasicMaterial>;
  private readonly raycaster = new THREE.Raycaster();
  private readonly corner = new THREE.Vector3();
  private positions: Float32Array = new Float32Array();
  private limits: Float32Array | undefined; // that the colours show
  private drawing = 0; // handle of the next drawing

  // Throws if the browser refuses another WebGL context.
  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    const material = new THREE.MeshStandardMaterial({ side: THREE.DoubleSide, flatShading: true, roughness: 0.9, polygonOffset: true });
    Object.assign(material, { polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
    this.edges = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ transparent: true, opacity: 0.2 }));
    this.pins = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ sizeAttenuation: false }));
    this.brush = new THREE.Mesh(new THREE.SphereGeometry(1, 24, 16), new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.3, depthWrite: false }));
    this.brush.visible = false;
    this.figure = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshStandardMaterial({ transparent: true, opacity: 0.35, roughness: 1 }));
    const light = new THREE.DirectionalLight(0xffffff, 2.2);
    light.position.set(0.4, 0.8, 1);
    this.camera.add(light, light.target);
    light.target.position.set(0, 0, -1);
    this.scene.add(this.camera, new THREE.AmbientLight(0xffffff, 1.6), this.mesh, this.edges, this.pins, this.figure, this.brush);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.resize()).observe(canvas);
    window.matchMedia("(prefers-color-scheme: light)").addEventListener("change", () => this.draw());
  }

  // Shows a mesh from its largest side.
  show(positions: Float32Array, triangles: Uint32Array): void {
    this.positions = positions;
    this.limits = undefined;
    for (const object of [this.mesh, this.edges, this.pins]) {
      object.geometry.dispose();
      object.geometry = new THREE.BufferGeometry();
    }
    const shared = new THREE.BufferAttribute(positions, 3);
    this.mesh.geometry.setAttribute("position", shared).setIndex(new THREE.BufferAttribute(triangles, 1));
    if (triangles.length / 3 <= kMaxEdges) this.edges.geometry = new THREE.WireframeGeometry(this.mesh.geometry);
    this.pins.geometry.setAttribute("position", shared).setIndex(new THREE.BufferAttribute(new Uint32Array(), 1));
    this.reset();
  }

  showPins(vertices: Uint32Array): void {
    this.pins.geometry.setIndex(new THREE.BufferAttribute(vertices, 1));
    this.draw();
  }

  // Colours the mesh by limits of its vertices, kNoLimit for none. Undefined: it has one colour.
  showLimits(limits: Float32Array | undefined): void {
    this.limits = limits;
    this.draw();
  }

  // Shows who wears the cloth. Undefined removes it.
  showFigure(figure: { positions: Float32Array; triangles: Uint32Array } | undefined): void {
    this.figure.geometry.dispose();
    this.figure.geometry = new THREE.BufferGeometry();
    if (figure) {
      this.figure.geometry.setAttribute("position", new THREE.BufferAttribute(figure.positions, 3)).setIndex(new THREE.BufferAttribute(figure.triangles, 1));
      this.figure.geometry.computeVertexNormals();
    }
    this.draw();
  }

  // Shows where the brush is, as a ball. Undefined hides it.
  showBrush(at: THREE.Vector3 | undefined, radius: number): void {
    this.brush.visible = at !== undefined;
    if (at) this.brush.position.copy(at);
    this.brush.scale.setScalar(radius);
    this.draw();
  }

  // Finds the place under a point of the canvas, which is in CSS pixels. Next to the mesh, it is the nearest vertex that
  // is at most `radius` from the line of sight.
  touch(x: number, y: number, radius: number): Touched | undefined {
    const { clientWidth, clientHeight } = this.canvas;
    this.camera.updateMatrixWorld();
    this.raycaster.setFromCamera(new THREE.Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.camera);
    const [hit] = this.raycaster.intersectObject(this.mesh, false);
    if (!hit?.face) return this.touchNextToMesh(radius);
    const { a, b, c } = hit.face;
    const away = (vertex: number) => this.corner.fromArray(this.positions, 3 * vertex).distanceToSquared(hit.point);
    const nearest = [a, b, c].reduce((best, vertex) => (away(vertex) < away(best) ? vertex : best));
    return { point: hit.point, corner: within(this.positions, this.placeOf(nearest), 0) };
  }

  private touchNextToMesh(radius: number): Touched | undefined {
    const { ray } = this.raycaster;
    let nearest = Infinity;
    for (let i = 0; i < this.positions.length; i += 3) {
      const point = this.corner.fromArray(this.positions, i);
      if (ray.distanceSqToPoint(point) > radius * radius) continue;
      nearest = Math.min(nearest, point.sub(ray.origin).dot(ray.direction));
    }
    return nearest === Infinity ? undefined : { point: ray.at(nearest, new THREE.Vector3()), corner: [] };
  }

  // Turns the view by steps to the right and up.
  turn(right: number, up: number): void {
    const way = new THREE.Spherical().setFromVector3(this.camera.position.sub(this.orbit.target));
    way.theta += right * kTurnStep;
    way.phi -= up * kTurnStep;
    this.camera.position.setFromSpherical(way.makeSafe()).add(this.orbit.target);
    this.orbit.update();
  }

  // Zooms in by steps.
  zoom(steps: number): void {
    this.camera.position.sub(this.orbit.target).multiplyScalar(kZoomStep ** -steps).add(this.orbit.target);
    this.orbit.update();
  }

  // Diameter of a ball in CSS pixels, at the middle of the mesh.
  pixelsOf(radius: number): number {
    const distance = this.camera.position.distanceTo(this.orbit.target);
    return (radius * this.canvas.clientHeight) / (distance * Math.tan(THREE.MathUtils.degToRad(kFieldOfView / 2)));
  }

  private placeOf(vertex: number): [number, number, number] {
    return [this.positions[3 * vertex]!, this.positions[3 * vertex + 1]!, this.positions[3 * vertex + 2]!];
  }

  // Looks at the largest side of the mesh. A mesh that lies flat is seen from above, with -z up.
  private reset(): void {
    this.resize();
    const bounds = boundsOf(this.positions);
    const size = sizeOf(bounds);
    const thin = size.indexOf(Math.min(...size));
    const [u, v] = thin === 2 ? [0, 1] : thin === 0 ? [2, 1] : [0, 2];
    const slope = Math.tan(THREE.MathUtils.degToRad(kFieldOfView / 2));
    const half = (kMargin / 2) * Math.max(size[v]!, size[u]! / this.camera.aspect);
    const longest = Math.max(...size) || 1;
    const distance = half / slope + size[thin]! / 2;
    const middle = new THREE.Vector3(...bounds.min).add(new THREE.Vector3(...bounds.max)).multiplyScalar(0.5);
    // OrbitControls keep the y axis upright, so a view from above is a little tilted.
    const way = new THREE.Vector3(thin === 0 ? 1 : 0, thin === 1 ? 1 : 0, thin === 2 ? 1 : thin === 1 ? 1e-3 : 0).normalize();
    this.camera.near = longest / 1000;
    this.camera.far = 100 * longest;
    this.camera.updateProjectionMatrix();
    this.camera.position.copy(middle).addScaledVector(way, distance || longest);
    this.orbit.target.copy(middle);
    this.orbit.minDistance = longest / 20;
    this.orbit.maxDistance = 10 * longest;
    this.orbit.update();
    this.draw();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  // Draws once, before the next picture of the browser.
  private draw(): void {
    if (this.drawing !== 0) return;
    this.drawing = window.requestAnimationFrame(() => {
      this.drawing = 0;
      const style = getComputedStyle(this.canvas);
      const colour = (name: string) => style.getPropertyValue(`--${name}`).trim();
      this.colourMesh(colour("edge"));
      this.figure.material.color.set(colour("quiet"));
      this.edges.material.color.set(colour("text"));
      this.pins.material.color.set(colour("accent"));
      this.pins.material.size = kPinSize * this.renderer.getPixelRatio();
      this.brush.material.color.set(colour("accent"));
      this.renderer.render(this.scene, this.camera);
    });
  }

  // A material with colours of vertices multiplies them with its own colour.
  private colourMesh(plain: string): void {
    const { geometry, material } = this.mesh;
    if (material.vertexColors !== (this.limits !== undefined)) {
      material.vertexColors = this.limits !== undefined;
      material.needsUpdate = true;
    }
    material.color.set(this.limits ? "white" : plain);
    if (!this.limits) return;
    if (!geometry.hasAttribute("color")) geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(this.positions.length), 3));
    const colours = geometry.getAttribute("color");
    const none = new THREE.Color(plain);
    const colour = new THREE.Color();
    const largest = largestOf(this.limits);
    this.limits.forEach((limit, vertex) => {
      const { r, g, b } = limit < 0 ? none : colour.setHSL(hueOf(limit, largest), 0.75, 0.5);
      colours.setXYZ(vertex, r, g, b);
    });
    colours.needsUpdate = true;
  }
}
