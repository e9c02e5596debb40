import { defineConfig } from "vite";

// The player of notebooks: one module, which the client's package carries.
export default defineConfig({
  publicDir: false,
  build: {
    outDir: "../transientcam/static",
    emptyOutDir: true,
    license: { fileName: "licences.json" },
    target: "es2022",
    lib: { entry: "src/widget/player.ts", formats: ["es"], fileName: () => "player.js" },
  },
});
