import { signal } from "@preact/signals";
import type { ExplanationDocument, FaultRequest, SimulationDocument } from "../stream/documents";
import { type Api, RequestError } from "./api";

export type EffectChoice = SimulationDocument["effects"][string];
export type Fault = FaultRequest["fault"];

/** The world that a simulated camera stands before, and what it calls for. */
export class Simulation {
  /** Null before it was read, and for a real camera. */
  readonly world = signal<SimulationDocument | null>(null);
  readonly explanation = signal<ExplanationDocument | null>(null);
  /** Why there is nothing to show. */
  readonly trouble = signal<string | null>(null);
  readonly #api: Api;

  constructor(api: Api) {
    this.#api = api;
  }

  async refresh(): Promise<void> {
    try {
      const [world, explanation] = await Promise.all([this.#api.ask("GET /simulation"), this.#api.ask("GET /simulation/explain")]);
      this.world.value = world;
      this.explanation.value = explanation;
      this.trouble.value = null;
    } catch (error) {
      if (!(error instanceof RequestError)) throw error;
      this.trouble.value = error.message;
    }
  }

  /** Reads the world anew; what it calls for, which takes the service longer, only where that was asked for before. */
  async follow(): Promise<void> {
    if (this.explanation.peek() !== null) return this.refresh();
    try {
      this.world.value = await this.#api.ask("GET /simulation");
    } catch (error) {
      if (!(error instanceof RequestError)) throw error; // read again with the next change
    }
  }

  /** Puts the camera before another scene; effects that were chosen stay chosen. */
  async stage(scene: string): Promise<void> {
    await this.#api.ask("PUT /simulation", { body: { scene } });
    await this.refresh();
  }

  /** Puts the camera before a scene of one's own: the text of its file. */
  async stageOwn(definition: string): Promise<void> {
    await this.#api.ask("PUT /simulation", { body: { definition } });
    await this.refresh();
  }

  /** Puts filter and diffuser before the lens, or takes them away. */
  async putDiffuser(diffuser: boolean): Promise<void> {
    await this.#api.ask("PUT /simulation", { body: { diffuser } });
    await this.refresh();
  }

  /** Forces an effect on or off, or leaves it to the scene. */
  async choose(effect: string, choice: EffectChoice | null): Promise<void> {
    const { [effect]: _, ...others } = this.world.peek()?.effects ?? {};
    await this.#api.ask("PUT /simulation", { body: { effects: choice === null ? others : { ...others, [effect]: choice } } });
    await this.refresh();
  }

  /** Leaves all effects to the scene. */
  async chooseNothing(): Promise<void> {
    await this.#api.ask("PUT /simulation", { body: { effects: {} } });
    await this.refresh();
  }

  async cause(fault: Fault): Promise<void> {
    this.world.value = await this.#api.ask("POST /simulation/faults", { body: { fault } });
  }
}
