// Shaders that compute light at the corners of triangles and not at each pixel (Gouraud, 1971). For a processor that
// draws, pixels are many times as many. Reflections and shadows are left out.

const SIDES = /* glsl */ `
varying vec3 vLit;
#ifdef DOUBLE_SIDED
varying vec3 vLitBehind;
#endif
#if defined(USE_MAP) || defined(USE_EMISSIVEMAP)
#define PICTURED
#endif`;

/** Without a picture the colour is already in the screen's space. */
export const CORNER_VERTEX = /* glsl */ `
uniform vec3 diffuse;
uniform vec3 emissive;
${SIDES}
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <lights_pars_begin>
#include <colorspace_pars_fragment>

vec3 lit(vec3 normal) {
  vec3 irradiance = ambientLightColor;
  #if NUM_HEMI_LIGHTS > 0
    #pragma unroll_loop_start
    for (int i = 0; i < NUM_HEMI_LIGHTS; i++) {
      irradiance += getHemisphereLightIrradiance(hemisphereLights[i], normal);
    }
    #pragma unroll_loop_end
  #endif
  #if NUM_DIR_LIGHTS > 0
    #pragma unroll_loop_start
    for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
      irradiance += max(dot(normal, directionalLights[i].direction), 0.0) * directionalLights[i].color;
    }
    #pragma unroll_loop_end
  #endif
  vec3 light = irradiance * RECIPROCAL_PI;
  #ifdef PICTURED
    return light;
  #else
    vec3 surface = diffuse;
    #if defined(USE_COLOR) || defined(USE_COLOR_ALPHA)
      surface *= vColor.rgb;
    #endif
    return sRGBTransferOETF(vec4(surface * light + emissive, 1.0)).rgb;
  #endif
}

void main() {
  #include <uv_vertex>
  #include <color_vertex>
  #include <batching_vertex>
  #include <beginnormal_vertex>
  #include <defaultnormal_vertex>
  #include <begin_vertex>
  #include <project_vertex>
  #include <fog_vertex>
  vec3 seen = normalize(transformedNormal);
  vLit = lit(seen);
  #ifdef DOUBLE_SIDED
    vLitBehind = lit(-seen);
  #endif
}`;

export const CORNER_FRAGMENT = /* glsl */ `
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
${SIDES}
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphatest_pars_fragment>
#include <emissivemap_pars_fragment>
#include <fog_pars_fragment>

void main() {
  vec4 diffuseColor = vec4(diffuse, opacity);
  #include <map_fragment>
  #include <color_fragment>
  #include <alphatest_fragment>
  #ifdef DOUBLE_SIDED
    vec3 outgoingLight = gl_FrontFacing ? vLit : vLitBehind;
  #else
    vec3 outgoingLight = vLit;
  #endif
  #ifdef PICTURED
    vec3 totalEmissiveRadiance = emissive;
    #include <emissivemap_fragment>
    outgoingLight = diffuseColor.rgb * outgoingLight + totalEmissiveRadiance;
    #include <opaque_fragment>
    #include <colorspace_fragment>
  #else
    #include <opaque_fragment>
  #endif
  #include <fog_fragment>
}`;
