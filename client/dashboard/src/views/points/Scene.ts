/** The point cloud on the screen, by three.js; loaded when the view is first shown. */
import {
  BufferAttribute,
  BufferGeometry,
  ColorManagement,
  LinearSRGBColorSpace,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  PerspectiveCamera,
  Points,
  PointsMaterial,
  Scene,
  Spherical,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { DEGREE } from "../../physics/constants";
import { type Cloud, fieldOfView, makeCloud } from "./cloud";
import { EyeDome } from "./eyeDome";
import { onScreen, pointUnder } from "./picking";
import type { Pinhole } from "./rays";
import { axesLines, type Floor, floorOf, frustumLines, gridLabels, gridLines, type Label } from "./room";

// Colours are those of the maps, byte for byte.
ColorManagement.enabled = false;

/** Of the grid, the camera's field of view, and its axes: x, y, z. */
const GRID: readonly number[] = [112, 120, 130];
const FRUSTUM: readonly number[] = [178, 134, 64];
const AXES: readonly (readonly number[])[] = [
  [213, 94, 0],
  [0, 158, 115],
  [86, 180, 233],
];

/** The picture that a cloud is made of. */
export type Field = Readonly<{ width: number; height: number; lens: Pinhole }>;

export class PointScene {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(45, 1, 0.01, 1000);
  readonly #controls: OrbitControls;
  readonly #material = new PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true });
  readonly #lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true }));
  readonly #dome = new EyeDome();
  /** Called after each drawing. */
  onDrawn: () => void = () => undefined;
  #shaded = true;
  #floor: Floor | null = null;
  #surrounded = "";
  #points: Points<BufferGeometry, PointsMaterial> | null = null;
  #cloud: Cloud = makeCloud(0);
  #asked = 0;
  #placed = false;
  #eye = false;
  #field: Field = { width: 1, height: 1, lens: { fx: 1, fy: 1, cx: 0, cy: 0 } };

  constructor(canvas: HTMLCanvasElement) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: false, alpha: true, powerPreference: "low-power" });
    this.#renderer.outputColorSpace = LinearSRGBColorSpace;
    this.#lines.frustumCulled = false;
    this.#scene.add(this.#lines);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.enableDamping = false;
    this.#controls.addEventListener("change", this.#draw);
    this.#controls.addEventListener("start", () => (this.#eye = false));
  }

  /** Room for the points of a picture; the same arrays until its size changes. */
  cloudFor(pixels: number): Cloud {
    if (this.#cloud.positions.length === 3 * pixels) return this.#cloud;
    if (this.#points !== null) {
      this.#scene.remove(this.#points);
      this.#points.geometry.dispose();
    }
    this.#cloud = makeCloud(pixels);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.#cloud.positions, 3));
    geometry.setAttribute("color", new BufferAttribute(this.#cloud.colours, 3, true));
    this.#points = new Points(geometry, this.#material);
    this.#points.frustumCulled = false; // its bounds change with every frame
    this.#scene.add(this.#points);
    return this.#cloud;
  }

  /** Shows the first `count` points of the cloud. */
  show(count: number, field: Field): void {
    if (this.#points === null) return;
    this.#field = field;
    const { geometry } = this.#points;
    geometry.setDrawRange(0, count);
    geometry.attributes.position.needsUpdate = true;
    geometry.attributes.color.needsUpdate = true;
    this.#surround(count);
    if (!this.#placed && count > 0) {
      this.#placed = true;
      this.aside();
    }
    this.#draw();
  }

  /** Looks from where the camera stands: the picture is the camera's own. */
  fromCamera(): void {
    const distance = this.#distance();
    this.#look([0, 0, 1e-6 * distance], -distance, true);
  }

  /** Looks from behind the camera and from its side, so that depth and the camera are seen. */
  aside(): void {
    const distance = this.#distance();
    this.#look([0.75 * distance, 0.45 * distance, 0.45 * distance], -0.6 * distance, false);
  }

  /** Looks from a place at one on the camera's axis, by the camera's own eye or another. */
  #look(from: readonly [number, number, number], target_z: number, eye: boolean): void {
    this.#eye = eye;
    this.#camera.position.set(...from);
    this.#controls.target.set(0, 0, target_z);
    this.#fit();
    this.#controls.update();
    this.#draw();
  }

  /** Turns around the target, and moves towards it by a factor. */
  turn(azimuth_rad: number, elevation_rad: number, nearer = 1): void {
    this.#eye = false;
    const arm = new Spherical().setFromVector3(new Vector3().subVectors(this.#camera.position, this.#controls.target));
    arm.theta += azimuth_rad;
    arm.phi -= elevation_rad;
    arm.radius *= nearer;
    this.#camera.position.setFromSpherical(arm.makeSafe()).add(this.#controls.target);
    this.#controls.update();
    this.#draw();
  }

  /** Colours changed, nothing else. */
  recolour(): void {
    if (this.#points === null) return;
    this.#points.geometry.attributes.color.needsUpdate = true;
    this.#draw();
  }

  /** Whether what stands behind its neighbours is darker; without, colours are those of the colour bar. */
  set shaded(shaded: boolean) {
    this.#shaded = shaded;
    this.#draw();
  }

  /** Whether floor, axes and field of view are shown. */
  set surrounded(shown: boolean) {
    this.#lines.visible = shown;
    this.#draw();
  }

  /** Numbers of the grid, in m; none where it is not shown. */
  get labels(): readonly Label[] {
    return this.#floor === null || !this.#lines.visible ? [] : gridLabels(this.#floor);
  }

  /** Where a point is on the canvas, in CSS px; null behind the eye. */
  placeOf([x, y, z]: readonly number[]): { readonly x: number; readonly y: number } | null {
    const { clientWidth, clientHeight } = this.#renderer.domElement;
    const at = onScreen(this.#matrix(), x, y, z, clientWidth, clientHeight);
    return at === null ? null : { x: at.x, y: at.y };
  }

  /** The pixel whose point is at a place of the canvas in CSS px; null for none. */
  pixelAt(x: number, y: number): number | null {
    const { clientWidth, clientHeight } = this.#renderer.domElement;
    const count = this.#points?.geometry.drawRange.count ?? 0;
    const found = pointUnder(this.#cloud.positions, count, this.#matrix(), clientWidth, clientHeight, { x, y });
    return found === null ? null : this.#cloud.pixels[found];
  }

  set pointSize_px(size: number) {
    this.#material.size = size * devicePixelRatio;
    this.#draw();
  }

  resize(width: number, height: number): void {
    this.#renderer.setPixelRatio(devicePixelRatio);
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#fit();
    this.#draw();
  }

  /** Draws now, for a caller that reads the canvas in this task. */
  drawNow(): void {
    cancelAnimationFrame(this.#asked);
    this.#asked = 0;
    if (this.#shaded) this.#dome.render(this.#renderer, this.#scene, this.#camera);
    else this.#renderer.render(this.#scene, this.#camera);
    this.onDrawn();
  }

  dispose(): void {
    cancelAnimationFrame(this.#asked);
    this.#controls.dispose();
    this.#points?.geometry.dispose();
    this.#material.dispose();
    this.#lines.geometry.dispose();
    this.#lines.material.dispose();
    this.#dome.dispose();
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  /** At most once a refresh of the display, and only when something changed. */
  readonly #draw = (): void => {
    if (this.#asked !== 0) return;
    this.#asked = requestAnimationFrame(() => this.drawNow());
  };

  /** The camera's own field of view fits the canvas, whichever side is the longer. */
  #fit(): void {
    const { width, height, lens } = this.#field;
    const half = Math.tan(fieldOfView(width, lens) / 2);
    const vertical = Math.max((half * height) / width, half / this.#camera.aspect);
    this.#camera.fov = this.#eye ? (2 * Math.atan(vertical)) / DEGREE : 45;
    this.#camera.updateProjectionMatrix();
  }

  /** Projection times view. */
  #matrix(): readonly number[] {
    this.#camera.updateMatrixWorld();
    return new Matrix4().multiplyMatrices(this.#camera.projectionMatrix, this.#camera.matrixWorldInverse).elements;
  }

  /** Floor, field of view and axes for the first `count` points, made anew only where they changed. */
  #surround(count: number): void {
    this.#floor = floorOf(this.#cloud.positions, count, this.#floor);
    const { width, height, lens } = this.#field;
    const wanted = JSON.stringify([this.#floor, this.#field]);
    if (this.#floor === null || wanted === this.#surrounded) return;
    this.#surrounded = wanted;
    const [grid, frustum, axes] = [gridLines(this.#floor), frustumLines(this.#floor, width, height, lens), axesLines(this.#floor)];
    const colours = [...coloured(grid, GRID), ...coloured(frustum, FRUSTUM), ...AXES.flatMap((each) => [...each, ...each])];
    this.#lines.geometry.dispose();
    this.#lines.geometry = new BufferGeometry();
    this.#lines.geometry.setAttribute("position", new BufferAttribute(Float32Array.from([...grid, ...frustum, ...axes]), 3));
    this.#lines.geometry.setAttribute("color", new BufferAttribute(Uint8Array.from(colours), 3, true));
  }

  /** How far the points are, by the middle one of a sample of them. */
  #distance(): number {
    const count = this.#points?.geometry.drawRange.count ?? 0;
    const depths: number[] = [];
    for (let n = 0; n < count; n += Math.max(1, count >> 9)) depths.push(-this.#cloud.positions[3 * n + 2]);
    depths.sort((a, b) => a - b);
    return depths[depths.length >> 1] ?? 1;
  }
}

/** The same colour for each end of lines. */
function coloured(lines: Float32Array, colour: readonly number[]): number[] {
  return Array.from({ length: lines.length / 3 }, () => colour).flat();
}
