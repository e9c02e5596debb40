/** The light of the last moments, fading: what plays leaves a trail behind. */

/** Moments that a trail is made of, the present one among them, and the share of its light that each keeps. */
export const TRAIL_SHARES = [1, 0.6, 0.36, 0.2] as const;

/** Phases of the moments of a trail that lasts `trail_rad`, the present one first; only that where there is no trail. */
export function trailPhases(phase_rad: number, trail_rad: number): number[] {
  if (trail_rad === 0) return [phase_rad];
  const step_rad = trail_rad / (TRAIL_SHARES.length - 1);
  // Light does not trail over the start of the period: there was none before.
  return TRAIL_SHARES.map((_, n) => phase_rad - n * step_rad).filter((each, n) => n === 0 || each >= 0);
}
