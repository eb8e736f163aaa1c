//! Words that mean something else where generated code stands.

/// Words that no identifier of ours may be, in groups that are each one reason; the first two are of the language, and hold for modules,
/// too.
pub(super) static RESERVED: [&str; 6] = [
    // Rust's keywords of all editions: strict, reserved, weak
    "abstract as async auto await become box break const continue crate do dyn else enum extern false final fn for \
     gen if impl in let loop macro macro_rules match mod move mut override priv pub raw ref return safe self static \
     struct super trait true try type typeof union unsafe unsized use virtual where while yield",
    // its primitive types, which a module of that name would hide, and the crates that are there without being named
    "alloc bool char core f16 f32 f64 f128 i8 i16 i32 i64 i128 isize proc_macro std str straightline test u8 u16 u32 \
     u64 u128 usize",
    // keywords of C and C++, for the header, and words that their usual macros replace
    "alignas alignof and and_eq asm assert bitand bitor case catch class co_await co_return co_yield compl complex \
     concept consteval constexpr constinit const_cast decltype default delete double dynamic_cast errno explicit \
     export far float friend goto i386 imaginary inline int interface linux long mutable namespace near new noexcept \
     noreturn not not_eq nullptr operator or or_eq private protected public register reinterpret_cast requires \
     restrict short signed sizeof small static_assert static_cast stderr stdin stdout switch template this \
     thread_local throw typedef typeid typename unix unsigned using void volatile wchar_t xor xor_eq",
    // inputs and results of the robot's functions
    "a ad bias c c_hat d d_hat djtf_dq dq dqd dsd e energy_loss f force g gravity h h_star impulse j j_bar jt_f lambda m \
     mu null_space p pivot q qd qdd q3 q4 \
     q5 q6 q7 q8 q9 restitution s sd sdd sdd_free smallest_contact_eigenvalue smallest_eigenvalue tau tv u v \
     violation w x xd",
    // what else the file, its modules and its types are written with
    "batch check_inertia check_number com configuration contact cost dd drivers dynamics figures fma fma_if fused inertia \
     lane limb live mass mode motion mul_add_f32 mul_add_f64 n none number numbers out_of_range parameters real self_test \
     self_test_hashes self_tests short_sines single some \
     staged t trig unphysical values velocity y",
    // types, traits and variants of Rust's preludes, in this writing
    "as_mut as_ref async_fn async_fn_mut async_fn_once c_str c_int c_char clone copy debug default display \
     double_ended_iterator drop eq err exact_size_iterator extend fn_mut fn_once from from_iterator future hash into \
     into_future into_iterator iterator ok option ord partial_eq partial_ord result send sized string sync to_owned \
     to_string try_from try_into unpin vec",
];

/// The words of some groups.
pub(super) fn words(groups: &'static [&'static str]) -> impl Iterator<Item = &'static str> {
    groups.iter().flat_map(|group| group.split(' '))
}
