import { BACKDROP_GAIN, DECADES, FULL_LIGHT } from "../scales/tone";
import light from "./light.frag?raw";

/** One triangle that covers the canvas, from the vertex number alone. */
export const VERTEX_SHADER = `#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

/** Eq. (2) at one time of flight, a fragment a pixel of the sensor, in the tones of the page. */
export const FRAGMENT_SHADER = `#version 300 es
#define OF_WHITE ${(1 / (DECADES * Math.log2(10))).toFixed(9)}
#define BACKDROP_GAIN ${BACKDROP_GAIN.toFixed(3)}
#define FULL_LIGHT ${FULL_LIGHT.toFixed(3)}
${light}`;
