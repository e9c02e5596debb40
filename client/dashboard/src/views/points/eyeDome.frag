// What stands behind its neighbours on the screen is darker.
uniform sampler2D colours;
uniform sampler2D depths;
uniform float near;
uniform float far;
uniform int reach;

float depthAt(ivec2 at) {
  return texelFetch(depths, clamp(at, ivec2(0), textureSize(depths, 0) - 1), 0).r;
}

float logarithm(float depth) {
  return log2(near * far / (far - depth * (far - near)));
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  gl_FragColor = texelFetch(colours, at, 0);
  float depth = depthAt(at);
  if (depth >= 1.0) return;  // nothing is there
  float own = logarithm(depth);
  float behind = 0.0;
  for (int step = -1; step <= 1; step += 2) {
    behind += max(0.0, own - logarithm(depthAt(at + ivec2(step * reach, 0))));
    behind += max(0.0, own - logarithm(depthAt(at + ivec2(0, step * reach))));
  }
  gl_FragColor.rgb *= exp(-STRENGTH * behind / 4.0);
}
