// Quotients and roots as the device has them.
fn divide(a: f32, b: f32) -> f32 { return a / b; }
fn square_root(x: f32) -> f32 { return sqrt(x); }
