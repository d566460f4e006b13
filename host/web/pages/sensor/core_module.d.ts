// What the build of host/web/wasm leaves in its folder.
declare module '@core/core.mjs' {
  import type { CoreModule, CoreModuleOptions } from './core_memory';
  export default function create(options: CoreModuleOptions): Promise<CoreModule>;
}
