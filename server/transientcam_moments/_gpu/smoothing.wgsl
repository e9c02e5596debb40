let radius = i32(params.radius);
let here = vec2<i32>(i32(p % params.width), i32(p / params.width));
for (var dy = -radius; dy <= radius; dy++) {
  let y = here.y + dy;
  if (y < 0 || y >= i32(params.height)) { continue; }
  for (var dx = -radius; dx <= radius; dx++) {
    let x = here.x + dx;
    if (x < 0 || x >= i32(params.width)) { continue; }
    let weight = weights[pixels + u32(dy + radius)] * weights[pixels + u32(dx + radius)];
    let at = u32(y) * params.width + u32(x);
    $sums
  }
}