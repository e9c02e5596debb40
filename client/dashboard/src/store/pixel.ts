/** A place on the sensor: column from the left, row from the top. */
export interface Pixel {
  readonly x: number;
  readonly y: number;
}
