/** Speed of light in vacuum, exact by definition of the metre. */
const SPEED_OF_LIGHT_M_S = 299_792_458;

/** Range of a direct return that arrives `time_s` after emission: light goes there and back. */
export function rangeOfTime_m(time_s: number): number {
  return 0.5 * SPEED_OF_LIGHT_M_S * time_s;
}

/** A degree in rad. */
export const DEGREE = Math.PI / 180;
