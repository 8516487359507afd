// Two pages, two builds: `--mode report` and `--mode dashboard` each make one HTML file in dist/ with its
// script and style inside, so that a report opens offline and the dashboard needs no file server.
import { defineConfig } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

export default defineConfig(({ mode }) => ({
  plugins: [viteSingleFile({ removeViteModuleLoader: true })],
  build: {
    outDir: "dist",
    emptyOutDir: false,
    modulePreload: false,
    rollupOptions: { input: `${mode}.html` },
  },
}));
