// Surfaces with a directional light. Two passes draw the same triangles. One draws colours, which may be smoothed at edges. The other
// draws the distance and the number of the nearest surface, which must not be smoothed. If nothing is smoothed or blended, one pass
// draws all.

struct Camera {
    // The depth is reversed: 1 at the near plane, 0 at the far plane.
    clip_from_camera: mat4x4<f32>,
    // Direction towards the light, camera axes. The last number is the offset from a surface at which its shadow is looked up, metres; 0
    // without shadows.
    light_direction: vec4<f32>,
    light_color: vec4<f32>,
    // Ambient, diffuse, specular. The last number is 1 for a perspective projection, and 0 for a parallel one.
    shares: vec4<f32>,
    // Transform to the shadow map: x and y from -1 to 1, and a depth of 1 next to the light.
    map_from_camera: mat4x4<f32>,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(0) var image: texture_2d<f32>;
@group(1) @binding(1) var image_sampler: sampler;
@group(2) @binding(0) var shadow_map: texture_depth_2d;
@group(2) @binding(1) var shadow_sampler: sampler_comparison;

struct Corner {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
}

// Rows of camera_from_mesh, and of the matrix for normals. They differ if a scale has three factors.
struct Item {
    @location(3) place_x: vec4<f32>,
    @location(4) place_y: vec4<f32>,
    @location(5) place_z: vec4<f32>,
    @location(6) turn_x: vec3<f32>,
    @location(7) turn_y: vec3<f32>,
    @location(8) turn_z: vec3<f32>,
    @location(9) color: vec4<f32>,
    @location(10) id: u32,
}

struct Lit {
    @builtin(position) clip: vec4<f32>,
    // Position in the camera's frame, metres.
    @location(0) place: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) @interpolate(flat) color: vec4<f32>,
    @location(4) @interpolate(flat) id: u32,
}

struct Exact {
    @builtin(position) clip: vec4<f32>,
    @location(0) depth: f32,
    @location(1) @interpolate(flat) id: u32,
}

fn placed(corner: Corner, item: Item) -> vec3<f32> {
    let at = vec4<f32>(corner.position, 1.0);
    return vec3<f32>(dot(item.place_x, at), dot(item.place_y, at), dot(item.place_z, at));
}

@vertex
fn lit_corner(corner: Corner, item: Item) -> Lit {
    var out: Lit;
    out.place = placed(corner, item);
    out.clip = camera.clip_from_camera * vec4<f32>(out.place, 1.0);
    let n = corner.normal;
    out.normal = vec3<f32>(dot(item.turn_x, n), dot(item.turn_y, n), dot(item.turn_z, n));
    out.uv = corner.uv;
    out.color = item.color;
    out.id = item.id;
    return out;
}

@vertex
fn exact_corner(corner: Corner, item: Item) -> Exact {
    var out: Exact;
    let place = placed(corner, item);
    out.clip = camera.clip_from_camera * vec4<f32>(place, 1.0);
    out.depth = -place.z;
    out.id = item.id;
    return out;
}

@vertex
fn shadow_corner(corner: Corner, item: Item) -> @builtin(position) vec4<f32> {
    return camera.map_from_camera * vec4<f32>(placed(corner, item), 1.0);
}

// Returns the part of the light that reaches a point of a surface. The normal has unit length and is on the lit side. The result is the
// mean of four samples of the map, each of which the sampler smooths.
fn light_that_comes(place: vec3<f32>, normal: vec3<f32>) -> f32 {
    let shift = camera.light_direction.w;
    if shift == 0.0 {
        return 1.0;
    }
    let at = camera.map_from_camera * vec4<f32>(place + shift * normal, 1.0);
    let middle = vec2<f32>(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y);
    // Outside of the map nothing casts a shadow.
    if any(middle < vec2<f32>(0.0)) || any(middle > vec2<f32>(1.0)) {
        return 1.0;
    }
    // A point beyond all casters may be in their shadow.
    let depth = clamp(at.z, 0.0, 1.0);
    let side = 0.5 / f32(textureDimensions(shadow_map).x);
    var comes = textureSampleCompareLevel(shadow_map, shadow_sampler, middle + vec2<f32>(side, side), depth);
    comes += textureSampleCompareLevel(shadow_map, shadow_sampler, middle + vec2<f32>(side, -side), depth);
    comes += textureSampleCompareLevel(shadow_map, shadow_sampler, middle + vec2<f32>(-side, side), depth);
    comes += textureSampleCompareLevel(shadow_map, shadow_sampler, middle + vec2<f32>(-side, -side), depth);
    return 0.25 * comes;
}

const SHININESS: f32 = 32.0;

fn lit(in: Lit) -> vec4<f32> {
    let base = textureSample(image, image_sampler, in.uv) * in.color;
    // Direction towards the camera.
    let eye = normalize(mix(vec3<f32>(0.0, 0.0, 1.0), -in.place, camera.shares.w));
    // The visible side is lit, whatever the winding of a file's triangles.
    var face = cross(dpdx(in.place), dpdy(in.place));
    face = select(face, -face, dot(face, eye) < 0.0);
    var normal = select(in.normal, -in.normal, dot(in.normal, face) < 0.0);
    normal = normalize(normal);
    let light = camera.light_direction.xyz;
    let diffuse = max(dot(normal, light), 0.0);
    let half = normalize(light + eye);
    let specular = select(0.0, pow(max(dot(normal, half), 0.0), SHININESS), diffuse > 0.0);
    var comes = 1.0;
    if diffuse > 0.0 {
        comes = light_that_comes(in.place, face * inverseSqrt(max(dot(face, face), 1e-36)));
    }
    let shares = camera.shares;
    let brightness = shares.x + comes * (shares.y * diffuse + shares.z * specular);
    return vec4<f32>(min(base.rgb * camera.light_color.rgb * brightness, vec3<f32>(1.0)), base.a);
}

@fragment
fn lit_pixel(in: Lit) -> @location(0) vec4<f32> {
    return lit(in);
}

struct Whole {
    @location(0) color: vec4<f32>,
    @location(1) depth: f32,
    @location(2) id: u32,
}

@fragment
fn whole_pixel(in: Lit) -> Whole {
    return Whole(lit(in), -in.place.z, in.id);
}

struct Measured {
    @location(0) depth: f32,
    @location(1) id: u32,
}

@fragment
fn exact_pixel(in: Exact) -> Measured {
    return Measured(in.depth, in.id);
}
