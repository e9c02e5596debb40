/** The point cloud on the screen, by three.js; loaded when the view is first shown. */
import {
  BufferAttribute,
  BufferGeometry,
  ColorManagement,
  LinearSRGBColorSpace,
  PerspectiveCamera,
  Points,
  PointsMaterial,
  Scene,
  Spherical,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { makeCloud, type Cloud } from "./cloud";

// Colours are those of the maps, byte for byte.
ColorManagement.enabled = false;

const DEGREE = Math.PI / 180;

export class PointScene {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(45, 1, 0.01, 1000);
  readonly #controls: OrbitControls;
  readonly #material = new PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true });
  #points: Points<BufferGeometry, PointsMaterial> | null = null;
  #cloud: Cloud = makeCloud(0);
  #asked = 0;
  #placed = false;
  #eye = false;
  #field = { width: 1, height: 1, fieldOfView_rad: 45 * DEGREE };

  constructor(canvas: HTMLCanvasElement) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: false, alpha: true, powerPreference: "low-power" });
    this.#renderer.outputColorSpace = LinearSRGBColorSpace;
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
  show(count: number, field: { width: number; height: number; fieldOfView_rad: number }): void {
    if (this.#points === null) return;
    this.#field = field;
    const { geometry } = this.#points;
    geometry.setDrawRange(0, count);
    geometry.attributes["position"].needsUpdate = true;
    geometry.attributes["color"].needsUpdate = true;
    if (!this.#placed && count > 0) {
      this.#placed = true;
      this.aside();
    }
    this.#draw();
  }

  /** Looks from where the camera stands: the picture is the camera's own. */
  fromCamera(): void {
    this.#eye = true;
    this.#camera.position.set(0, 0, 1e-6 * this.#distance());
    this.#controls.target.set(0, 0, -this.#distance());
    this.#fit();
    this.#controls.update();
    this.#draw();
  }

  /** Looks from the side, so that depth is seen. */
  aside(): void {
    this.#eye = false;
    const distance = this.#distance();
    this.#controls.target.set(0, 0, -distance);
    this.#camera.position.set(0.5 * distance, 0.3 * distance, -0.05 * distance);
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
    this.#renderer.render(this.#scene, this.#camera);
  }

  dispose(): void {
    cancelAnimationFrame(this.#asked);
    this.#controls.dispose();
    this.#points?.geometry.dispose();
    this.#material.dispose();
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
  }

  /** At most once a refresh of the display, and only when something changed. */
  readonly #draw = (): void => {
    if (this.#asked !== 0) return;
    this.#asked = requestAnimationFrame(() => {
      this.drawNow();
    });
  };

  /** The camera's own field of view fits the canvas, whichever side is the longer. */
  #fit(): void {
    const { width, height, fieldOfView_rad } = this.#field;
    const half = Math.tan(fieldOfView_rad / 2);
    const vertical = Math.max((half * height) / width, half / this.#camera.aspect);
    this.#camera.fov = this.#eye ? (2 * Math.atan(vertical)) / DEGREE : 45;
    this.#camera.updateProjectionMatrix();
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
