
@compute @workgroup_size($group)
fn $name(@builtin(global_invocation_id) id: vec3<u32>) {
  let pixels = params.width * params.height;
  let p = id.y * ${row}u + id.x;
  if (p >= pixels) { return; }
$lines
}
