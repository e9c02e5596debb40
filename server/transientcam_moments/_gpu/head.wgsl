// Bindings, and words that stand for no operator: what all shaders begin with.
struct Params {
  width: u32, height: u32, radius: u32, stride: u32,
  bad: u32, zero: u32, epsilon: f32, least: f32,
  full_scale: f32, threshold: f32, metres: f32, nan: f32,
}
@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> raw: array<u32>;  // two u16 each, image after image
@group(0) @binding(2) var<storage, read> inverse: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read> weights: array<f32>;  // of pixels, then taps
@group(0) @binding(4) var<storage, read> places: array<u32>;  // of bad pixels in `replaced`, from 1
@group(0) @binding(5) var<storage, read> replaced: array<vec2<f32>>;
@group(0) @binding(6) var<storage, read_write> moments: array<vec2<f32>>;
@group(0) @binding(7) var<storage, read_write> out: array<u32>;

// A value as it was rounded: no compiler knows that `zero` is 0.
fn rounded(x: f32) -> f32 { return bitcast<f32>(bitcast<u32>(x) ^ params.zero); }
// 12 leading bits of a factor: products of such are exact.
fn lost_by_squaring(x: f32, square: f32) -> f32 {
  let high = bitcast<f32>(bitcast<u32>(x) & 0xfffff000u);
  let low = rounded(x - high);
  return (rounded(high * high - square) + 2.0 * high * low) + low * low;
}
// WGSL promises quotients and roots to 2.5 units and more: a step of Newton's makes it one.
fn quotient(a: f32, b: f32) -> f32 {
  let near = divide(1.0, b);
  let y = near * (2.0 - b * near);
  let q = a * y;
  return q + y * (a - q * b);
}
fn root_of(x: f32) -> f32 {
  let y = square_root(x);
  return select(y, y + divide(0.5 * (x - y * y), y), y > 0.0);
}
fn finite(x: f32) -> bool { return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u; }
fn image(i: u32, p: u32, pixels: u32) -> f32 {
  let at = i * pixels + p;
  let word = raw[at >> 1u];
  return f32(select(word & 0xffffu, word >> 16u, (at & 1u) == 1u));
}
fn times(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
  return vec2<f32>(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}
fn conjugate(a: vec2<f32>) -> vec2<f32> { return vec2<f32>(a.x, -a.y); }
// log(1 + x) to the last digits of x, from -1/2 to 3: halved three times, then a series.
fn log_1p(x: f32) -> f32 {
  let half = quotient(x, 1.0 + root_of(1.0 + x));
  let quarter = quotient(half, 1.0 + root_of(1.0 + half));
  let eighth = quotient(quarter, 1.0 + root_of(1.0 + quarter));
  let c = quotient(eighth, 2.0 + eighth);
  let square = c * c;
  return 16.0 * c * (1.0 + square * (0.33333333 + square * (0.2 + square * 0.14285714)));
}
// log x of a number that is not subnormal: of its exponent and of its digits, from 1/2 to 2.
fn log_of(x: f32) -> f32 {
  let bits = bitcast<u32>(x);
  let digits = bitcast<f32>((bits & 0x007fffffu) | 0x3f800000u);
  let power = f32(i32(bits >> 23u) - 127);
  return 0.6931471805599453 * power + log_1p(digits - 1.0);
}
