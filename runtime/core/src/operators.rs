//! Operators as a table: of a type with its generic parameters, in brackets, each operator's value of both operands; or all assignments.

macro_rules! operators {
    (@ [$($generics:tt)*] $Type:ty, $Op:ident $op:ident |$a:ident $(, $b:ident)?| $value:expr) => {
        #[allow(clippy::suspicious_arithmetic_impl)] // derivatives of a product have sums in them
        impl<$($generics)*> core::ops::$Op for $Type {
            type Output = Self;
            #[inline]
            fn $op(self $(, $b: Self)?) -> Self {
                let $a = self;
                $value
            }
        }
    };
    (assign [$($generics:tt)*] $Type:ty) => {
        $crate::operators::operators!(assign [$($generics)*] $Type: AddAssign add_assign +, SubAssign sub_assign -, MulAssign mul_assign *, DivAssign div_assign /);
    };
    (assign $generics:tt $Type:ty: $($Op:ident $op:ident $by:tt),+) => {
        $($crate::operators::operators!(assign_one $generics $Type, $Op $op $by);)+
    };
    (assign_one [$($generics:tt)*] $Type:ty, $Op:ident $op:ident $by:tt) => {
        impl<$($generics)*> core::ops::$Op for $Type {
            fn $op(&mut self, b: Self) {
                *self = *self $by b;
            }
        }
    };
    ($generics:tt $Type:ty: $($Op:ident $op:ident |$a:ident $(, $b:ident)?| $value:expr;)+) => {
        $($crate::operators::operators!(@ $generics $Type, $Op $op |$a $(, $b)?| $value);)+
    };
}
pub(crate) use operators;
