//! Small scenes with known results, drawn by any Vulkan device: Mesa's software renderer suffices.

use std::sync::Arc;

use glamx::dcamera::rh::proj::opengl;
use glamx::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::*;
use crate::primitives;
use crate::scene::{Item, Light, Part, Vertex};

const SIDE: u32 = 64;
const BOX: [f32; 4] = [1.0, 0.5, 0.25, 1.0];
const ALL: Planes = Planes { color: true, depth: true, segmentation: true };

fn renderer() -> Renderer {
    Renderer::new(Gpu::open(None).unwrap()).unwrap()
}

fn item(surface: &Arc<Surface>, at: DVec3, id: u32) -> Item {
    Item { surface: Arc::clone(surface), world_from_mesh: DAffine3::from_translation(at), color: BOX, id }
}

/// Returns a scene seen from the origin along -z, with a light from behind the camera.
fn scene(items: Vec<Item>) -> Scene {
    Scene {
        width: SIDE,
        height: SIDE,
        view: DMat4::IDENTITY,
        projection: opengl::perspective(std::f64::consts::FRAC_PI_2, 1.0, 0.1, 100.0),
        planes: ALL,
        light: Light {
            direction: DVec3::Z,
            color: [1.0; 3],
            ambient: 0.5,
            diffuse: 0.25,
            specular: 0.0,
            shadow: false,
        },
        background: [0.0, 0.0, 1.0],
        items,
    }
}

/// Returns a pixel of a plane with 4 bytes per pixel.
fn word(plane: &Option<Vec<u8>>, x: u32, y: u32) -> [u8; 4] {
    let index = 4 * (y * SIDE + x) as usize;
    plane.as_ref().unwrap()[index..index + 4].try_into().unwrap()
}

fn depth(picture: &Picture, x: u32, y: u32) -> f64 {
    f64::from(f32::from_le_bytes(word(&picture.depth, x, y)))
}

fn id(picture: &Picture, x: u32, y: u32) -> u32 {
    u32::from_le_bytes(word(&picture.segmentation, x, y))
}

fn color(picture: &Picture, x: u32, y: u32) -> [u8; 3] {
    let index = 3 * (y * SIDE + x) as usize;
    picture.color.as_ref().unwrap()[index..index + 3].try_into().unwrap()
}

fn assert_near(found: [u8; 3], expected: [f64; 3]) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((f64::from(*found) - 255.0 * expected).abs() <= 1.0, "{found} is not {}", 255.0 * expected);
    }
}

#[test]
fn a_box_has_its_distance_its_number_and_its_colour_and_all_else_the_background() {
    let mut renderer = renderer();
    let surface = Arc::new(renderer.upload(&primitives::cube()).unwrap());
    let picture = renderer.draw(&scene(vec![item(&surface, DVec3::new(0.0, 0.0, -3.0), 7)])).unwrap();
    // The face is 2.5 m ahead and 1 m wide: a fifth of the 5 m wide view, from pixel 25.6 to 38.4.
    for (x, y) in [(27, 27), (32, 32), (37, 37), (27, 37)] {
        assert!((depth(&picture, x, y) - 2.5).abs() < 1e-5, "{}", depth(&picture, x, y));
        assert_eq!(id(&picture, x, y), 7);
        assert_near(color(&picture, x, y), [0.75, 0.375, 0.1875]);
    }
    for (x, y) in [(0, 0), (63, 63), (24, 32), (40, 32), (32, 24), (32, 40)] {
        assert_eq!(depth(&picture, x, y), f64::INFINITY);
        assert_eq!(id(&picture, x, y), 0);
        assert_near(color(&picture, x, y), [0.0, 0.0, 1.0]);
    }
    assert_eq!(picture.color.unwrap().len(), 3 * 64 * 64);
}

#[test]
fn up_is_up_and_left_is_left() {
    let mut renderer = renderer();
    let surface = Arc::new(renderer.upload(&primitives::cube()).unwrap());
    let picture = renderer.draw(&scene(vec![item(&surface, DVec3::new(-1.5, 1.5, -3.0), 1)])).unwrap();
    assert_eq!(
        [id(&picture, 12, 12), id(&picture, 51, 12), id(&picture, 12, 51), id(&picture, 51, 51)],
        [1, 0, 0, 0]
    );
}

#[test]
fn depth_is_along_the_axis_and_the_nearer_surface_is_seen() {
    let mut renderer = renderer();
    let wall = Arc::new(renderer.upload(&primitives::cube()).unwrap());
    let ball = Arc::new(renderer.upload(&primitives::ball(256)).unwrap());
    let mut wall = item(&wall, DVec3::new(0.0, 0.0, -10.5), 1);
    wall.world_from_mesh.matrix3 = DMat3::from_diagonal(DVec3::new(40.0, 40.0, 1.0));
    let items = vec![item(&ball, DVec3::new(0.0, 0.0, -4.0), 2), wall];
    let picture = renderer.draw(&scene(items)).unwrap();
    for x in [0, 10, 63] {
        assert!((depth(&picture, x, 5) - 10.0).abs() < 1e-4, "not along the ray: {}", depth(&picture, x, 5));
        assert_eq!(id(&picture, x, 5), 1);
    }
    assert_eq!(id(&picture, 32, 32), 2);
    // The middle of the pixel is half a pixel off the axis: the ray's angle is atan(1 / 64) both ways.
    let sine = 2.0_f64.sqrt() / 64.0;
    assert!((depth(&picture, 32, 32) - 3.0).abs() < 16.0 * sine * sine + 2e-4);
}

#[test]
fn distant_things_are_drawn_as_exactly() {
    let mut renderer = renderer();
    let surface = Arc::new(renderer.upload(&primitives::ball(64)).unwrap());
    let here = scene(vec![item(&surface, DVec3::new(0.25, 0.0, -3.0), 1)]);
    let there = DVec3::new(4_194_304.0, -1_048_576.0, 65_536.0);
    let mut far = scene(vec![item(&surface, there + DVec3::new(0.25, 0.0, -3.0), 1)]);
    far.view = DMat4::from_translation(-there);
    assert!(renderer.draw(&here).unwrap() == renderer.draw(&far).unwrap());
}

#[test]
fn translucent_surfaces_show_the_background_and_have_their_own_depth() {
    let mut renderer = renderer();
    let surface = Arc::new(renderer.upload(&primitives::cube()).unwrap());
    let glass = Item { color: [0.0, 1.0, 0.0, 0.5], ..item(&surface, DVec3::new(0.0, 0.0, -3.0), 1) };
    let behind = Item { color: [1.0, 0.0, 0.0, 1.0], ..item(&surface, DVec3::new(0.0, 0.0, -5.0), 2) };
    let none = Item { color: [1.0; 4].map(|_| 0.0), ..item(&surface, DVec3::new(0.0, 0.0, -1.8), 3) };
    let picture = renderer.draw(&scene(vec![glass, behind, none])).unwrap();
    // Front and back of the glass are both visible and lit: a quarter of the colour behind remains.
    let [red, green, _] = color(&picture, 32, 32);
    assert!(red.abs_diff(48) <= 2 || red.abs_diff(96) <= 2, "{red}");
    assert!(green > 90, "{green}");
    assert_eq!(id(&picture, 32, 32), 1);
    assert!((depth(&picture, 32, 32) - 2.5).abs() < 1e-5);
}

#[test]
fn an_image_begins_at_its_upper_left_corner() {
    let mut renderer = renderer();
    let corner = |x: f32, y: f32, uv| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv };
    let vertices = vec![
        corner(-1.0, 1.0, [0.0, 0.0]),
        corner(1.0, 1.0, [1.0, 0.0]),
        corner(1.0, -1.0, [1.0, 1.0]),
        corner(-1.0, -1.0, [0.0, 1.0]),
    ];
    let (red, white) = ([255, 0, 0, 255], [255; 4]);
    // The upper left quarter is red.
    let rgba: Vec<u8> = (0..16).flat_map(|at| if at % 4 < 2 && at / 4 < 2 { red } else { white }).collect();
    let image = Image { width: 4, height: 4, rgba };
    let parts = vec![Part { first: 0, count: 6, color: Some([1.0; 4]), image: Some(0) }];
    let mesh = Mesh { vertices, indices: vec![0, 1, 2, 0, 2, 3], parts, images: vec![image] };
    let surface = Arc::new(renderer.upload(&mesh).unwrap());
    let picture = renderer.draw(&scene(vec![item(&surface, DVec3::new(0.0, 0.0, -1.0), 1)])).unwrap();
    assert_near(color(&picture, 15, 15), [0.75, 0.0, 0.0]);
    assert_near(color(&picture, 48, 48), [0.75; 3]);
}

#[test]
fn the_ground_is_measured_to_a_tenth_of_a_millimetre() {
    let mut renderer = renderer();
    let surface = Arc::new(renderer.upload(&primitives::plane()).unwrap());
    let mut scene = scene(vec![item(&surface, DVec3::ZERO, 1)]);
    // The camera is 1.5 m above it, looking 45 degrees down.
    let eye = DVec3::new(3.0, -2.0, 1.5);
    let world_from_camera =
        DAffine3::from_rotation_translation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_4), eye);
    scene.view = DMat4::from(world_from_camera.inverse());
    let picture = renderer.draw(&scene).unwrap();
    for y in 8..SIDE {
        // In the camera's axes the ray of a pixel is (x, v, -1), and the ground's normal (0, s, s).
        let v = 1.0 - (2.0 * f64::from(y) + 1.0) / f64::from(SIDE);
        let expected = 1.5 / (std::f64::consts::FRAC_1_SQRT_2 * (1.0 - v));
        if expected < 10.0 {
            let found = depth(&picture, 20, y);
            assert!((found - expected).abs() < 1e-4, "{y}: {found} is not {expected}");
        }
    }
}

#[test]
fn a_parallel_projection_has_depth_too() {
    let mut renderer = renderer();
    let surface = Arc::new(renderer.upload(&primitives::cube()).unwrap());
    let mut scene = scene(vec![item(&surface, DVec3::new(0.0, 0.0, -3.0), 1)]);
    scene.projection = opengl::orthographic(-1.0, 1.0, -1.0, 1.0, 0.1, 10.0);
    let picture = renderer.draw(&scene).unwrap();
    assert!((depth(&picture, 20, 20) - 2.5).abs() < 1e-5);
    assert_eq!([id(&picture, 17, 32), id(&picture, 14, 32)], [1, 0]);
    assert_near(color(&picture, 32, 32), [0.75, 0.375, 0.1875]);
}

/// A wall 10 m ahead and a box of 1 m half way there, with light from the side. The box's shadow lies on the
/// wall from x = -6 m to -4 m.
#[test]
fn surfaces_in_a_shadow_have_only_the_ambient_light() {
    for smooths in [true, false] {
        let mut gpu = Gpu::open(None).unwrap();
        gpu.smooths &= smooths;
        let mut renderer = Renderer::new(gpu).unwrap();
        let surface = Arc::new(renderer.upload(&primitives::cube()).unwrap());
        let mut wall = item(&surface, DVec3::new(0.0, 0.0, -10.5), 1);
        wall.world_from_mesh.matrix3 = DMat3::from_diagonal(DVec3::new(40.0, 40.0, 1.0));
        let mut scene = scene(vec![wall, item(&surface, DVec3::new(0.0, 0.0, -5.0), 2)]);
        scene.light.direction = DVec3::new(1.0, 0.0, 1.0);
        let bright = renderer.draw(&scene).unwrap();
        scene.light.shadow = true;
        let shaded = renderer.draw(&scene).unwrap();
        let lit = [1.0, 0.5, 0.25].map(|part| part * (0.5 + 0.25 * std::f64::consts::FRAC_1_SQRT_2));
        // A pixel of the wall is 5 / 16 m.
        assert_near(color(&shaded, 16, 32), [0.5, 0.25, 0.125]);
        assert_near(color(&bright, 16, 32), lit);
        // On the box, on the wall beside it, and on the wall beyond the shadow: no surface shades itself.
        for (x, y) in [(32, 32), (48, 32), (8, 32), (24, 32), (16, 28), (16, 36)] {
            assert_near(color(&shaded, x, y), lit);
        }
        for x in 0..SIDE {
            assert_near(color(&shaded, x, 8), lit);
        }
        assert!(shaded.depth == bright.depth && shaded.segmentation == bright.segmentation);
    }
}

/// A plane is too large for the shadow map, and lies below all items in it.
#[test]
fn the_ground_takes_shadows_and_what_is_beside_the_picture_casts_them() {
    let mut renderer = renderer();
    let ground = Arc::new(renderer.upload(&primitives::plane()).unwrap());
    let ball = Arc::new(renderer.upload(&primitives::ball(64)).unwrap());
    // Seen from above, 20 m wide, with a ball of 1 m out of sight on the left. Its shadow falls 3 m to the
    // right of it.
    let mut scene = scene(vec![item(&ground, DVec3::ZERO, 1), item(&ball, DVec3::new(-12.0, 0.0, 3.0), 2)]);
    scene.view = DMat4::from_translation(DVec3::new(0.0, 0.0, -20.0));
    scene.projection = opengl::orthographic(-10.0, 10.0, -10.0, 10.0, 0.1, 100.0);
    scene.light.direction = DVec3::new(-1.0, 0.0, 1.0);
    scene.light.shadow = true;
    let picture = renderer.draw(&scene).unwrap();
    let lit = [1.0, 0.5, 0.25].map(|part| part * (0.5 + 0.25 * std::f64::consts::FRAC_1_SQRT_2));
    // At x = -9 m.
    assert_near(color(&picture, 3, 32), [0.5, 0.25, 0.125]);
    assert_near(color(&picture, 3, 24), lit);
    assert_near(color(&picture, 32, 32), lit);
    assert_eq!(id(&picture, 3, 32), 1);
}

#[test]
fn one_pass_draws_what_two_draw() {
    let mut gpu = Gpu::open(None).unwrap();
    gpu.smooths = false;
    let mut renderer = Renderer::new(gpu).unwrap();
    let surface = Arc::new(renderer.upload(&primitives::ball(64)).unwrap());
    let items =
        vec![item(&surface, DVec3::new(0.3, 0.1, -3.0), 7), item(&surface, DVec3::new(-0.3, 0.1, -3.5), 8)];
    let all = renderer.draw(&scene(items.clone())).unwrap();
    let mut of = |planes: Planes| renderer.draw(&Scene { planes, ..scene(items.clone()) }).unwrap();
    assert!(all.color == of(Planes { color: true, ..Planes::default() }).color);
    let exact = of(Planes { color: false, ..ALL });
    assert!(all.depth == exact.depth && all.segmentation == exact.segmentation);
}

#[test]
fn only_what_is_asked_for_comes_back_in_any_size() {
    let mut renderer = renderer();
    for (width, height, planes) in [
        (1, 1, Planes { depth: true, ..Planes::default() }),
        (333, 7, Planes { color: true, ..Planes::default() }),
        (65, 65, Planes { segmentation: true, ..Planes::default() }),
        (4096, 2, ALL),
    ] {
        let picture = renderer.draw(&Scene { width, height, planes, ..scene(Vec::new()) }).unwrap();
        let pixels = (width * height) as usize;
        assert_eq!(picture.color.map(|plane| plane.len()), planes.color.then_some(3 * pixels));
        assert_eq!(picture.depth.map(|plane| plane.len()), planes.depth.then_some(4 * pixels));
        assert_eq!(picture.segmentation.map(|plane| plane.len()), planes.segmentation.then_some(4 * pixels));
    }
    for (width, height) in [(0, 1), (1, 0), (4097, 1)] {
        let refused = renderer.draw(&Scene { width, height, ..scene(Vec::new()) }).unwrap_err();
        assert!(matches!(refused, DrawError::Size { .. }), "{refused}");
    }
}
