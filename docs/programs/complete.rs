use std::ffi::{c_char, c_void, CStr};
use std::ptr;

#[repr(C)]
struct Points { data: *const c_void, count: i64, row_stride: i64, column_stride: i64, kind: i32 }
#[repr(C)]
struct Output { data: *mut c_void, count: i64, row_stride: i64, column_stride: i64, kind: i32 }
#[repr(C)]
struct Mask { data: *const u8, count: i64, stride: i64 }
#[repr(C)]
struct FrameReport {
    known: i64, filled: i64, disconnected: i64, rejected: i64, iterations: i64, seconds: f64,
    blend: f64, prior_weight: f64, prior_share: f64, first_order_share: f64,
    standard_error: f64, quality: i32, reason: [c_char; 512],
}

#[link(name = "dynmesh")]
extern "C" {
    fn dynmesh_last_message() -> *const c_char;
    fn dynmesh_create(faces: *const i32, n_faces: i64, first_frame: *const Points,
                      settings: *const c_void, completer: *mut *mut c_void) -> i32;
    fn dynmesh_push(completer: *mut c_void, points: *const Points, known: *const Mask,
                    out: *const Output, report: *mut FrameReport) -> i32;
    fn dynmesh_destroy(completer: *mut c_void);
}

fn check(status: i32) {
    let message = unsafe { CStr::from_ptr(dynmesh_last_message()) };
    assert!(status == 0, "{}", message.to_string_lossy());
}

fn main() {
    let faces = [0, 1, 2, 2, 1, 3];
    let mut frame = [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];
    let data = frame.as_mut_ptr().cast();
    let points = Points { data, count: 4, row_stride: 3, column_stride: 1, kind: 32 };
    let out = Output { data, count: 4, row_stride: 3, column_stride: 1, kind: 32 };
    let mut completer = ptr::null_mut();
    let mut report: FrameReport = unsafe { std::mem::zeroed() };
    unsafe {
        check(dynmesh_create(faces.as_ptr(), 2, &points, ptr::null(), &mut completer));
        *data.cast::<f32>().add(11) = 5.0;
        let known = [0u8, 0, 0, 1];
        let mask = Mask { data: known.as_ptr(), count: 4, stride: 1 };
        check(dynmesh_push(completer, &points, &mask, &out, &mut report));
        dynmesh_destroy(completer);
    }
    println!("{} filled in; vertex 0 is at height {:.3}", report.filled, frame[2]);
}
