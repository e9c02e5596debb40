import { describe, expect, it } from "vitest";

import { Api } from "../../../client/dashboard/src/store/api";
import { Simulation } from "../../../client/dashboard/src/store/simulation";

/** A service with one scene set; it keeps what it was sent. */
function service(effects: Record<string, string>) {
  const sent: unknown[] = [];
  const api = new Api((input, init) => {
    const path = String(input).replace("api/v1", "");
    if (init?.method === "PUT") {
      const body = JSON.parse(String(init.body)) as { effects?: Record<string, string> };
      sent.push(body);
      effects = body.effects ?? effects;
    }
    const world = { scene: "mirrors", effects, scenes: [], plugged: true, faults: [] };
    const body = path === "/simulation" ? world : { noise_floor_dn: 20, called_above: 0.1, effects: [] };
    return Promise.resolve(new Response(JSON.stringify(body)));
  });
  return { simulation: new Simulation(api), sent };
}

describe("choices of effects", () => {
  it("are added to those that were made before", async () => {
    const { simulation, sent } = service({ ambient: "on" });
    await simulation.refresh();
    await simulation.choose("motion", "off");
    expect(sent).toEqual([{ effects: { ambient: "on", motion: "off" } }]);
    expect(simulation.world.value?.effects).toEqual({ ambient: "on", motion: "off" });
  });

  it("are taken back one by one", async () => {
    const { simulation, sent } = service({ ambient: "on", motion: "off" });
    await simulation.refresh();
    await simulation.choose("ambient", null);
    expect(sent).toEqual([{ effects: { motion: "off" } }]);
  });

  it("stay as they are when the scene changes", async () => {
    const { simulation, sent } = service({ ambient: "on" });
    await simulation.refresh();
    await simulation.set({ scene: "corner" });
    expect(sent).toEqual([{ scene: "corner" }]);
    expect(simulation.world.value?.effects).toEqual({ ambient: "on" });
  });
});

describe("a real camera", () => {
  it("has no world but the service's own words about it", async () => {
    const problem = { type: "/problems/not-simulated", status: 404, detail: "This camera is a real one." };
    const simulation = new Simulation(new Api(() => Promise.resolve(new Response(JSON.stringify(problem), { status: 404 }))));
    await simulation.refresh();
    expect(simulation.world.value).toBeNull();
    expect(simulation.trouble.value).toBe("This camera is a real one.");
  });
});
