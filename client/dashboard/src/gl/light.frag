// Eq. (2) at one time of flight, a fragment a pixel of the sensor.
//
// A texel of `coefficients` holds two complex numbers, a_2l and a_(2l+1) in layer l; in the place of
// a_0 = 1 stands E. With `asNumbers` the density itself is written, which needs a framebuffer of floats.
// OF_WHITE, BACKDROP_GAIN and FULL_LIGHT are those of scales/tone.ts.
precision highp float;
precision highp sampler2D;
precision highp sampler2DArray;
uniform sampler2DArray coefficients;
uniform sampler2D backdrop;
uniform sampler2D colours;
uniform int layers;
uniform vec2 z;                // exp(i phi)
uniform float baseFrequencyHz;
uniform float white;           // density shown brightest
uniform float backdropWhite;   // 0: no backdrop
uniform int tone;              // linear, root, logarithmic
uniform bool asNumbers;
out vec4 colour;

vec2 horner(vec2 p, vec2 a) {  // (p + conj(a)) z
  p += vec2(a.x, -a.y);
  return vec2(p.x * z.x - p.y * z.y, p.x * z.y + p.y * z.x);
}

float density(ivec2 at) {
  vec2 p = vec2(0.0);
  for (int layer = layers - 1; layer >= 1; layer--) {
    vec4 pair = texelFetch(coefficients, ivec3(at, layer), 0);
    p = horner(horner(p, pair.zw), pair.xy);
  }
  vec4 first = texelFetch(coefficients, ivec3(at, 0), 0);
  p = horner(p, first.zw);
  p.x += 1.0;
  return first.x * baseFrequencyHz / dot(p, p);
}

void main() {
  // The sensor's first row is on top, a framebuffer's at the bottom; numbers keep the sensor's order.
  ivec2 size = textureSize(coefficients, 0).xy;
  ivec2 at = ivec2(gl_FragCoord.xy);
  if (!asNumbers) at.y = size.y - 1 - at.y;
  float value = density(at);
  if (asNumbers) {
    colour = vec4(value, 0.0, 0.0, 1.0);
    return;
  }
  float share = value / white;
  share = share >= 0.0 ? min(share, 1.0) : 0.0;  // not a number: no density, no light
  float place = share;
  if (tone == 1) place = sqrt(share);
  if (tone == 2) place = share > 0.0 ? max(0.0, 1.0 + log2(share) * OF_WHITE) : 0.0;
  vec3 light = texelFetch(colours, ivec2(clamp(int(place * 256.0), 0, 255), 0), 0).rgb;
  if (backdropWhite > 0.0) {
    float scene = texelFetch(backdrop, at, 0).r / backdropWhite;
    float grey = scene > 0.0 ? BACKDROP_GAIN * sqrt(min(scene, 1.0)) : 0.0;
    light = 1.0 - (1.0 - grey) * (1.0 - light * smoothstep(0.0, FULL_LIGHT, place));
  }
  colour = vec4(light, 1.0);
}
