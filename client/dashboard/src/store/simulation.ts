import { signal } from "@preact/signals";
import type { ExplanationDocument, FaultRequest, SimulationDocument, SimulationRequest } from "../stream/documents";
import { type Api, refusalIn } from "./api";

export type EffectChoice = SimulationDocument["effects"][string];
export type Fault = FaultRequest["fault"];

/** The world that a simulated camera stands before, and what it calls for. */
export class Simulation {
  /** Null before it was read, and for a real camera. */
  readonly world = signal<SimulationDocument | null>(null);
  readonly explanation = signal<ExplanationDocument | null>(null);
  /** Why there is nothing to show. */
  readonly trouble = signal<string | null>(null);

  constructor(private readonly api: Api) {}

  async refresh(): Promise<void> {
    try {
      const [world, explanation] = await Promise.all([this.api.ask("GET /simulation"), this.api.ask("GET /simulation/explain")]);
      this.world.value = world;
      this.explanation.value = explanation;
      this.trouble.value = null;
    } catch (error) {
      this.trouble.value = refusalIn(error).message;
    }
  }

  /** Reads the world anew; what it calls for, which takes the service longer, only where that was asked for before. */
  async follow(): Promise<void> {
    if (this.explanation.peek() !== null) return this.refresh();
    try {
      this.world.value = await this.api.ask("GET /simulation");
    } catch (error) {
      refusalIn(error); // read again with the next change
    }
  }

  /** The same where it was read before. */
  async keepUp(): Promise<void> {
    if (this.world.peek() !== null) await this.follow();
  }

  /** Changes the world: the scene, effects that are forced, the diffuser before the lens. Answered once it is prepared; what is absent stays as it is. */
  async set(wanted: SimulationRequest): Promise<void> {
    await this.api.ask("PUT /simulation", { body: wanted });
    await this.refresh();
  }

  /** Forces an effect on or off, or leaves it to the scene. */
  async choose(effect: string, choice: EffectChoice | null): Promise<void> {
    const { [effect]: _, ...others } = this.world.peek()?.effects ?? {};
    await this.set({ effects: choice === null ? others : { ...others, [effect]: choice } });
  }

  async cause(fault: Fault): Promise<void> {
    this.world.value = await this.api.ask("POST /simulation/faults", { body: { fault } });
  }
}
