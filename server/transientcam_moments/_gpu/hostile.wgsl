// Quotients and roots wrong by up to two units in the last place, as WGSL allows a device to have them.
fn spoilt(x: f32) -> f32 {
  let bits = bitcast<u32>(x);
  if (!finite(x) || (bits & 0x7f800000u) < 0x01000000u) { return x; }
  return bitcast<f32>(bits + ((bits * 2654435761u) >> 16u) % 5u - 2u);
}
fn divide(a: f32, b: f32) -> f32 { return spoilt(a / b); }
fn square_root(x: f32) -> f32 { return spoilt(sqrt(x)); }
