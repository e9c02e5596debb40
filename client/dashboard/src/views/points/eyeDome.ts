/** Eye-dome lighting: what stands behind its neighbours on the screen is darker, so that edges and folds are seen (Boucheny 2009). */
import {
  BufferAttribute,
  BufferGeometry,
  DepthTexture,
  Mesh,
  NearestFilter,
  NoBlending,
  OrthographicCamera,
  type PerspectiveCamera,
  Scene,
  ShaderMaterial,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import fragment from "./eyeDome.frag?raw";

/** How far away neighbours are, in CSS px, and how dark a step of twice the distance makes. */
const REACH_PX = 1.5;
const STRENGTH = 4;

const VERTEX = "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }";

export class EyeDome {
  readonly #target = new WebGLRenderTarget(1, 1, {
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    depthTexture: new DepthTexture(1, 1),
  });
  readonly #material = new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: fragment,
    defines: { STRENGTH: STRENGTH.toFixed(1) },
    blending: NoBlending,
    depthTest: false,
    depthWrite: false,
    uniforms: {
      colours: { value: this.#target.texture },
      depths: { value: this.#target.depthTexture },
      near: { value: 1 },
      far: { value: 2 },
      reach: { value: 1 },
    },
  });
  readonly #screen = new Scene();
  readonly #flat = new OrthographicCamera();
  readonly #triangle = new BufferGeometry();

  constructor() {
    this.#triangle.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const mesh = new Mesh(this.#triangle, this.#material);
    mesh.frustumCulled = false;
    this.#screen.add(mesh);
  }

  render(renderer: WebGLRenderer, scene: Scene, camera: PerspectiveCamera): void {
    const { width, height } = renderer.domElement;
    this.#target.setSize(width, height);
    renderer.setRenderTarget(this.#target);
    renderer.clear();
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    const { near, far, reach } = this.#material.uniforms;
    [near.value, far.value, reach.value] = [camera.near, camera.far, Math.max(1, Math.round(REACH_PX * renderer.getPixelRatio()))];
    renderer.render(this.#screen, this.#flat);
  }

  dispose(): void {
    this.#target.depthTexture?.dispose();
    this.#target.dispose();
    this.#material.dispose();
    this.#triangle.dispose();
  }
}
