/** Mean and standard deviation (with N - 1) of numbers; NaN where too few are given. */
export function statistics(values: readonly number[]): { readonly mean: number; readonly std: number } {
  const count = values.length;
  const mean = count === 0 ? NaN : values.reduce((sum, value) => sum + value, 0) / count;
  // Two passes: the squares of ranges that differ by millimetres would cancel.
  const squares = values.reduce((sum, value) => sum + (value - mean) ** 2, 0);
  return { mean, std: count > 1 ? Math.sqrt(squares / (count - 1)) : NaN };
}
