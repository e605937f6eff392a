// The WebGL context of the view, with options that suit the machine.

/** Options for every machine. The canvas is opaque, so the browser need not draw behind it. */
const ALWAYS: WebGLContextAttributes = { alpha: false, stencil: false, powerPreference: "low-power" };

/** Smooths edges only where a graphics processor draws: the processor takes twice as long for them. Throws if the browser has no WebGL 2. */
export function drawingContext(canvas: HTMLCanvasElement): WebGL2RenderingContext {
  const context = canvas.getContext("webgl2", { ...ALWAYS, antialias: !drawsInSoftware() });
  if (!context) throw new Error("there is no WebGL 2");
  return context;
}

/** Whether the processor draws: the context's options cannot be changed afterwards. */
function drawsInSoftware(): boolean {
  const probe = document.createElement("canvas").getContext("webgl2", { ...ALWAYS, antialias: false, depth: false });
  if (!probe) return true;
  const answer = isSoftware(probe);
  // Browsers allow few contexts.
  probe.getExtension("WEBGL_lose_context")?.loseContext();
  return answer;
}

/** Whether the processor draws, according to the browser. */
export function isSoftware(context: WebGLRenderingContext | WebGL2RenderingContext): boolean {
  const names = [context.getParameter(context.RENDERER) as unknown];
  const extension = context.getExtension("WEBGL_debug_renderer_info");
  if (extension) names.push(context.getParameter(extension.UNMASKED_RENDERER_WEBGL) as unknown);
  return names.some((name) => typeof name === "string" && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name));
}
