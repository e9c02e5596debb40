/// <reference types="vitest/config" />
import { defineConfig } from "vite";

// The daemon a developer's page talks to while Vite serves the sources.
const DAEMON = process.env.TRANSIENTCAM_URL ?? "http://127.0.0.1:8000";

export default defineConfig({
  // The service may stand below a path of a proxy.
  base: "./",
  build: {
    // The wheel carries what stands here; the daemon serves it at `/`.
    outDir: "../../server/transientcam_server/static",
    // What of others the page carries, each with its SPDX identifier and the text of its licence.
    license: { fileName: "licences.json" },
    emptyOutDir: true,
    target: "es2022",
    // A data: URL would need its own line in the Content-Security-Policy.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    // What the views share comes first, in one file, as rules of a component come after the base's; a drawing or a film when it is saved.
    rolldownOptions: {
      output: { codeSplitting: { groups: [{ name: "page", test: /src.(base|s\w+|ui.(?!drawing|film))|preact|uplot/ }] } },
    },
    // three, which is loaded when points in space are first shown
    chunkSizeWarningLimit: 800,
  },
  worker: { format: "es" },
  server: { proxy: { "/api": { target: DAEMON, ws: true } } },
  // The tests stand with all others of the project, and find packages here.
  resolve: { dedupe: ["@preact/signals", "@msgpack/msgpack", "idb-keyval"] },
  test: { dir: "../../tests/dashboard", environment: "node" },
});
