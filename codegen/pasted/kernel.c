/* Sine, cosine, square root and sign in C99 alone: the twin of `runtime/core/src/trig.rs`, operation by operation, to the same bits.
 * What each step is for, and what it loses, stands there.
 *
 * No file of this name is compiled: `robot_` becomes the prefix of a package, and a package gets the sections that it uses. A section
 * begins with a line of its own, which names it; the sections that it needs stand before it. In f32 nothing is wider than 32 bits.
 */

/*== bits_f64 */
/* The bits of a number. Reading another member of a union is defined by C99 (6.5.2.3, TC3); a call of memcpy might be one. */
typedef union {
    double number;
    uint64_t bits;
} robot_bits_f64;

static uint64_t robot_to_bits_f64(double x)
{
    robot_bits_f64 both;
    both.number = x;
    return both.bits;
}

static double robot_from_bits_f64(uint64_t bits)
{
    robot_bits_f64 both;
    both.bits = bits;
    return both.number;
}

/*== angle_f64 */
/* The sum of some angles, rounded, and what the rounding lost. */
typedef struct {
    double sum;
    double tail;
} robot_angle_f64;

static robot_angle_f64 robot_first_angle_f64(double x)
{
    robot_angle_f64 angle;
    angle.sum = x;
    angle.tail = 0.0;
    return angle;
}

/*== next_angle_f64 */
/* TwoSum (Knuth 1969). */
static robot_angle_f64 robot_next_angle_f64(robot_angle_f64 before, double x)
{
    robot_angle_f64 angle;
    const double next = before.sum + x;
    const double added = next - before.sum;
    angle.tail = before.tail + ((before.sum - (next - added)) + (x - added));
    angle.sum = next;
    return angle;
}

/*== sin_cos_of_sum_f64 */
/* Sine and cosine of an angle. */
typedef struct {
    double sine;
    double cosine;
} robot_turn_f64;

/* Within 0.797 ulp for |x| <= 13176794, NaN beyond. */
static robot_turn_f64 robot_sin_cos_of_sum_f64(robot_angle_f64 angle)
{
    const double round = 6755399441055744.0; /* 1.5 * 2^52 */
    const double domain = 13176794.0;
    const uint64_t sign = UINT64_C(0x8000000000000000);

    /* k is the nearest integer to x * 2/pi; y0 + y1 is x - k * pi/2, pi/2 in four parts */
    const double x = angle.sum;
    const double shifted = (x * 0.6366197723675814) + round;
    const uint64_t quadrant = robot_to_bits_f64(shifted);
    const double k = shifted - round;
    const double r0 = x - (k * 1.570796325802803);
    const double w = k * 9.920935791635221e-10;
    const double r1 = r0 - w;
    const double e1 = (r0 - r1) - w;
    const double t = ((k * 5.17018297889025e-19) - e1) - angle.tail;
    const double y0 = r1 - t;
    const double y1 = ((r1 - y0) - t) - (k * 2.9038559739793605e-28);

    /* sin y = y0 + (y0 * z * S(z) + y1 * cos y), cos y = 1 - y^2/2 + z^2 * C(z), of z = y0^2 */
    const double z = y0 * y0;
    const double s6 = -7.384541077267838e-13;
    const double s5 = 1.605422047840546e-10 + (z * s6);
    const double s4 = -2.5052070283413337e-8 + (z * s5);
    const double s3 = 2.7557319071880108e-6 + (z * s4);
    const double s2 = -0.00019841269840959285 + (z * s3);
    const double s1 = 0.00833333333333304 + (z * s2);
    const double s0 = -0.16666666666666666 + (z * s1);
    const double c5 = -1.135874923991542e-11;
    const double c4 = 2.0875705396029103e-9 + (z * c5);
    const double c3 = -2.755731421703886e-7 + (z * c4);
    const double c2 = 2.480158728900208e-5 + (z * c3);
    const double c1 = -0.0013888888888873342 + (z * c2);
    const double c0 = 0.041666666666666595 + (z * c1);
    const double a = robot_from_bits_f64(robot_to_bits_f64(y0) & UINT64_C(0xfffffffff8000000));
    const double b = (y0 - a) + y1;
    const double half_aa = (0.5 * a) * a;
    const double lead = 1.0 - half_aa;
    const double rest = ((1.0 - lead) - half_aa) - ((0.5 * b) * (y0 + a));
    const double cos_y = lead + (rest + ((z * z) * c0));
    const double sin_y = y0 + (((y0 * z) * s0) + (y1 * cos_y));

    /* an odd k exchanges the two, the second bits of k and of k + 1 give the signs */
    const uint64_t sin_bits = robot_to_bits_f64(sin_y) | (robot_to_bits_f64(y0) & sign);
    const uint64_t cos_bits = robot_to_bits_f64(cos_y);
    const uint64_t exchange = (sin_bits ^ cos_bits) & (UINT64_C(0) - (quadrant & UINT64_C(1)));
    const uint64_t sin_sign = (quadrant & UINT64_C(2)) << 62;
    const uint64_t cos_sign = ((quadrant + UINT64_C(1)) & UINT64_C(2)) << 62;
    /* all ones, a NaN, outside the domain: bits of positive numbers are ordered as the numbers are */
    const uint64_t magnitude = robot_to_bits_f64(x) & ~sign;
    const uint64_t outside = (magnitude > robot_to_bits_f64(domain)) ? UINT64_C(0xffffffffffffffff) : UINT64_C(0);
    robot_turn_f64 turn;
    turn.sine = robot_from_bits_f64(((sin_bits ^ exchange) ^ sin_sign) | outside);
    turn.cosine = robot_from_bits_f64(((cos_bits ^ exchange) ^ cos_sign) | outside);
    return turn;
}

/*== sin_cos_f64 */
static robot_turn_f64 robot_sin_cos_f64(double x)
{
    return robot_sin_cos_of_sum_f64(robot_first_angle_f64(x));
}

/*== sqrt_f64 */
/* Square root, correctly rounded: Newton's steps, and its last bits made right as an integer; NaN below zero. */
static double robot_sqrt_f64(double x)
{
    const uint64_t fraction = UINT64_C(0x000fffffffffffff);
    const uint64_t one = UINT64_C(0x0010000000000000);
    const uint64_t sign = UINT64_C(0x8000000000000000);
    const bool lift = x < 2.2250738585072014e-308; /* subnormal */
    const uint64_t bits = robot_to_bits_f64(x * (lift ? 18014398509481984.0 : 1.0));
    const uint64_t exponent = (bits >> 52) + UINT64_C(1);
    const uint64_t odd = exponent & UINT64_C(1);
    const double m = robot_from_bits_f64((bits & fraction) | ((UINT64_C(1023) + odd) << 52));
    const double half = 0.5 * m;
    const double guess = robot_from_bits_f64(UINT64_C(0x5fe6eb50c7b537a9) - (robot_to_bits_f64(m) >> 1));
    const double inverse1 = guess * (1.5 - ((half * guess) * guess));
    const double inverse2 = inverse1 * (1.5 - ((half * inverse1) * inverse1));
    const double inverse3 = inverse2 * (1.5 - ((half * inverse2) * inverse2));
    const double near = m * inverse3;
    const double nearer = 0.5 * (near + (m / near));

    /* m * 2^104 - n^2 modulo 2^64, compared as numbers with a sign */
    const uint64_t n = robot_to_bits_f64(nearer) - (UINT64_C(1022) << 52);
    const uint64_t rest = (((bits & fraction) | one) << (UINT64_C(52) + odd)) - (n * n);
    const uint64_t up = ((rest ^ sign) > (n ^ sign)) ? UINT64_C(1) : UINT64_C(0);
    const uint64_t down = ((rest ^ sign) <= ((UINT64_C(0) - n) ^ sign)) ? UINT64_C(1) : UINT64_C(0);
    const uint64_t biased = ((exponent >> 1) + UINT64_C(511)) - (lift ? UINT64_C(27) : UINT64_C(0));
    double root = x;
    if (x < 0.0) {
        root = robot_from_bits_f64(UINT64_C(0x7ff8000000000000));
    } else if ((x > 0.0) && (x <= 1.7976931348623157e308)) {
        root = robot_from_bits_f64((biased << 52) + (((n + up) - down) - one));
    } else {
        /* zeros, infinity and NaN are their own roots */
    }
    return root;
}

/*== sign_f64 */
/* -1, 0 or 1 as x is below, at or above zero; NaN for NaN. */
static double robot_sign_f64(double x)
{
    double sign = x;
    if (x > 0.0) {
        sign = 1.0;
    } else if (x < 0.0) {
        sign = -1.0;
    } else if (x >= 0.0) {
        sign = 0.0;
    } else {
        /* NaN */
    }
    return sign;
}

/*== is_finite_f64 */
static bool robot_is_finite_f64(double x)
{
    return (x >= -1.7976931348623157e308) && (x <= 1.7976931348623157e308);
}

/*== check_inertia_f64 */
/* Whether a body can have these: 0, or why not, as said in the header. A rounding error of the trace is forgiven. */
static int robot_check_inertia_f64(double mass, const double com[3], const double inertia[6])
{
    const double xx = inertia[0];
    const double xy = inertia[1];
    const double xz = inertia[2];
    const double yy = inertia[3];
    const double yz = inertia[4];
    const double zz = inertia[5];
    bool finite = robot_is_finite_f64(mass);
    bool zero = true;
    int why = 0;
    for (uint32_t i = 0U; i < 3U; i++) {
        finite = robot_is_finite_f64(com[i]) && finite;
    }
    for (uint32_t i = 0U; i < 6U; i++) {
        finite = robot_is_finite_f64(inertia[i]) && finite;
        zero = (inertia[i] >= 0.0) && (inertia[i] <= 0.0) && zero;
    }
    if (!finite) {
        why = 1;
    } else if (mass < 0.0) {
        why = 2;
    } else if ((mass <= 0.0) && (!zero)) {
        why = 3;
    } else {
        /* the second moment tr(J)/2 - J has no negative eigenvalue */
        const double half = 0.5 * ((xx + yy) + zz);
        const double slack = 3.552713678800501e-15 * half;
        const double a = (half - xx) + slack;
        const double b = (half - yy) + slack;
        const double c = (half - zz) + slack;
        const double d = -xy;
        const double e = -xz;
        const double f = -yz;
        const double ab = (a * b) - (d * d);
        const double ac = (a * c) - (e * e);
        const double bc = (b * c) - (f * f);
        const double determinant = ((a * bc) - (d * ((d * c) - (f * e)))) + (e * ((d * f) - (b * e)));
        const bool diagonal = (a >= 0.0) && (b >= 0.0) && (c >= 0.0);
        const bool minors = (ab >= 0.0) && (ac >= 0.0) && (bc >= 0.0);
        const bool possible = diagonal && minors && (determinant >= (((-slack) * half) * half));
        if (!possible) {
            why = 4;
        }
    }
    return why;
}

/*== arithmetic_check_f64 */
/* A product that is not exact, and a sum: of numbers that no compiler knows, as others are computed. */
static int robot_arithmetic_check_f64(void)
{
    volatile double read = 134217729.0;
    double factor;
    double product;
    double least;
    factor = read;
    read = 18014398777917440.0; /* factor * factor, rounded */
    product = read;
    read = 1.6653345369377348e-16; /* three quarters of the distance from 1 to the next number */
    least = read;
    const double lost = (factor * factor) - product;
    const double more = (1.0 + least) - 1.0;
    const bool is_rounded = (lost >= 0.0) && (lost <= 0.0) && (more > least);
    return is_rounded ? 0 : 1;
}

/*== bits_f32 */
/* The bits of a number. Reading another member of a union is defined by C99 (6.5.2.3, TC3); a call of memcpy might be one. */
typedef union {
    float number;
    uint32_t bits;
} robot_bits_f32;

static uint32_t robot_to_bits_f32(float x)
{
    robot_bits_f32 both;
    both.number = x;
    return both.bits;
}

/*== from_bits_f32 */
static float robot_from_bits_f32(uint32_t bits)
{
    robot_bits_f32 both;
    both.bits = bits;
    return both.number;
}

/*== angle_f32 */
/* The sum of some angles, rounded, and what the rounding lost. */
typedef struct {
    float sum;
    float tail;
} robot_angle_f32;

static robot_angle_f32 robot_first_angle_f32(float x)
{
    robot_angle_f32 angle;
    angle.sum = x;
    angle.tail = 0.0F;
    return angle;
}

/*== next_angle_f32 */
/* TwoSum (Knuth 1969). */
static robot_angle_f32 robot_next_angle_f32(robot_angle_f32 before, float x)
{
    robot_angle_f32 angle;
    const float next = before.sum + x;
    const float added = next - before.sum;
    angle.tail = before.tail + ((before.sum - (next - added)) + (x - added));
    angle.sum = next;
    return angle;
}

/*== turn_f32 */
/* Sine and cosine of an angle. */
typedef struct {
    float sine;
    float cosine;
} robot_turn_f32;

/*== sin_cos_of_sum_f32 */
/* Within 0.771 ulp for |x| <= 51471, NaN beyond. */
static robot_turn_f32 robot_sin_cos_of_sum_f32(robot_angle_f32 angle)
{
    const float round = 12582912.0F; /* 1.5 * 2^23 */
    const float domain = 51471.0F;
    const uint32_t sign = UINT32_C(0x80000000);

    /* k is the nearest integer to x * 2/pi; y0 + y1 is x - k * pi/2, pi/2 in five parts */
    const float x = angle.sum;
    const float shifted = (x * 0.63661975F) + round;
    const uint32_t quadrant = robot_to_bits_f32(shifted);
    const float k = shifted - round;
    const float r0 = (x - (k * 1.5703125F)) - (k * 0.00048351288F);
    const float w = k * 3.138557e-7F;
    const float r1 = r0 - w;
    const float e1 = (r0 - r1) - w;
    const float t = ((k * 6.070877e-11F) - e1) - angle.tail;
    const float y0 = r1 - t;
    const float y1 = ((r1 - y0) - t) - (k * 6.223372e-14F);

    /* sin y = y0 + (y0 * z * S(z) + y1 * cos y), cos y = 1 - y^2/2 + z^2 * C(z), of z = y0^2 */
    const float z = y0 * y0;
    const float s3 = 2.83251e-6F;
    const float s2 = -0.00019853064F + (z * s3);
    const float s1 = 0.00833338F + (z * s2);
    const float s0 = -0.16666667F + (z * s1);
    const float c2 = 2.4432327e-5F;
    const float c1 = -0.001388731F + (z * c2);
    const float c0 = 0.041666646F + (z * c1);
    const float a = robot_from_bits_f32(robot_to_bits_f32(y0) & UINT32_C(0xfffff000));
    const float b = (y0 - a) + y1;
    const float half_aa = (0.5F * a) * a;
    const float lead = 1.0F - half_aa;
    const float rest = ((1.0F - lead) - half_aa) - ((0.5F * b) * (y0 + a));
    const float cos_y = lead + (rest + ((z * z) * c0));
    const float sin_y = y0 + (((y0 * z) * s0) + (y1 * cos_y));

    /* an odd k exchanges the two, the second bits of k and of k + 1 give the signs */
    const uint32_t sin_bits = robot_to_bits_f32(sin_y) | (robot_to_bits_f32(y0) & sign);
    const uint32_t cos_bits = robot_to_bits_f32(cos_y);
    const uint32_t exchange = (sin_bits ^ cos_bits) & (UINT32_C(0) - (quadrant & UINT32_C(1)));
    const uint32_t sin_sign = (quadrant & UINT32_C(2)) << 30;
    const uint32_t cos_sign = ((quadrant + UINT32_C(1)) & UINT32_C(2)) << 30;
    /* all ones, a NaN, outside the domain: bits of positive numbers are ordered as the numbers are */
    const uint32_t magnitude = robot_to_bits_f32(x) & ~sign;
    const uint32_t outside = (magnitude > robot_to_bits_f32(domain)) ? UINT32_C(0xffffffff) : UINT32_C(0);
    robot_turn_f32 turn;
    turn.sine = robot_from_bits_f32(((sin_bits ^ exchange) ^ sin_sign) | outside);
    turn.cosine = robot_from_bits_f32(((cos_bits ^ exchange) ^ cos_sign) | outside);
    return turn;
}

/*== sin_cos_f32 */
static robot_turn_f32 robot_sin_cos_f32(float x)
{
    return robot_sin_cos_of_sum_f32(robot_first_angle_f32(x));
}

/*== short_kernel_f32 */
/* Of y + k * pi/2, |y| <= pi/4: polynomials in y^2, an odd k exchanges the two, further quarter turns change signs. */
static robot_turn_f32 robot_short_kernel_f32(float y, float shifted)
{
    const uint32_t quadrant = robot_to_bits_f32(shifted);
    const float z = y * y;
    const float s3 = -0.0001949454F;
    const float s2 = 0.00833197F + (z * s3);
    const float s1 = -0.16666651F + (z * s2);
    const float c4 = 2.4437297e-5F;
    const float c3 = -0.0013887358F + (z * c4);
    const float c2 = 0.041666646F + (z * c3);
    const float c1 = -0.5F + (z * c2);
    const float sin_y = y + ((y * z) * s1);
    const float cos_y = 1.0F + (z * c1);
    const bool odd = (quadrant & UINT32_C(1)) != UINT32_C(0);
    const bool half_turn = (quadrant & UINT32_C(2)) != UINT32_C(0);
    const float sine = odd ? cos_y : sin_y;
    const float cosine = odd ? -sin_y : cos_y;
    robot_turn_f32 turn;
    turn.sine = half_turn ? -sine : sine;
    turn.cosine = half_turn ? -cosine : cosine;
    return turn;
}

/*== short_sin_cos_f32 */
/* Within 9.3e-8 for |x| <= 402; beyond, numbers without meaning. pi/2 in two parts. */
static robot_turn_f32 robot_short_sin_cos_f32(float x)
{
    const float round = 12582912.0F; /* 1.5 * 2^23 */
    const float shifted = (x * 0.63661975F) + round;
    const float k = shifted - round;
    return robot_short_kernel_f32((x - (k * 1.5703125F)) - (k * 0.0004838268F), shifted);
}

/*== short_sin_cos_of_sum_f32 */
/* The same of a sum. */
static robot_turn_f32 robot_short_sin_cos_of_sum_f32(robot_angle_f32 angle)
{
    const float round = 12582912.0F; /* 1.5 * 2^23 */
    const float x = angle.sum;
    const float shifted = (x * 0.63661975F) + round;
    const float k = shifted - round;
    return robot_short_kernel_f32((x - (k * 1.5703125F)) - ((k * 0.0004838268F) - angle.tail), shifted);
}

/*== sqrt_f32 */
/* Square root, correctly rounded: Newton's steps, and its last bits made right as an integer; NaN below zero. */
static float robot_sqrt_f32(float x)
{
    const uint32_t fraction = UINT32_C(0x007fffff);
    const uint32_t one = UINT32_C(0x00800000);
    const uint32_t sign = UINT32_C(0x80000000);
    const bool lift = x < 1.1754944e-38F; /* subnormal */
    const uint32_t bits = robot_to_bits_f32(x * (lift ? 16777216.0F : 1.0F));
    const uint32_t exponent = (bits >> 23) + UINT32_C(1);
    const uint32_t odd = exponent & UINT32_C(1);
    const float m = robot_from_bits_f32((bits & fraction) | ((UINT32_C(127) + odd) << 23));
    const float half = 0.5F * m;
    const float guess = robot_from_bits_f32(UINT32_C(0x5f3759df) - (robot_to_bits_f32(m) >> 1));
    const float inverse1 = guess * (1.5F - ((half * guess) * guess));
    const float inverse2 = inverse1 * (1.5F - ((half * inverse1) * inverse1));
    const float near = m * inverse2;
    const float nearer = 0.5F * (near + (m / near));

    /* m * 2^46 - n^2 modulo 2^32, compared as numbers with a sign */
    const uint32_t n = robot_to_bits_f32(nearer) - (UINT32_C(126) << 23);
    const uint32_t rest = (((bits & fraction) | one) << (UINT32_C(23) + odd)) - (n * n);
    const uint32_t up = ((rest ^ sign) > (n ^ sign)) ? UINT32_C(1) : UINT32_C(0);
    const uint32_t down = ((rest ^ sign) <= ((UINT32_C(0) - n) ^ sign)) ? UINT32_C(1) : UINT32_C(0);
    const uint32_t biased = ((exponent >> 1) + UINT32_C(63)) - (lift ? UINT32_C(12) : UINT32_C(0));
    float root = x;
    if (x < 0.0F) {
        root = robot_from_bits_f32(UINT32_C(0x7fc00000));
    } else if ((x > 0.0F) && (x <= 3.4028235e38F)) {
        root = robot_from_bits_f32((biased << 23) + (((n + up) - down) - one));
    } else {
        /* zeros, infinity and NaN are their own roots */
    }
    return root;
}

/*== sign_f32 */
/* -1, 0 or 1 as x is below, at or above zero; NaN for NaN. */
static float robot_sign_f32(float x)
{
    float sign = x;
    if (x > 0.0F) {
        sign = 1.0F;
    } else if (x < 0.0F) {
        sign = -1.0F;
    } else if (x >= 0.0F) {
        sign = 0.0F;
    } else {
        /* NaN */
    }
    return sign;
}

/*== is_finite_f32 */
static bool robot_is_finite_f32(float x)
{
    return (x >= -3.4028235e38F) && (x <= 3.4028235e38F);
}

/*== check_inertia_f32 */
/* Whether a body can have these: 0, or why not, as said in the header. A rounding error of the trace is forgiven. */
static int robot_check_inertia_f32(float mass, const float com[3], const float inertia[6])
{
    const float xx = inertia[0];
    const float xy = inertia[1];
    const float xz = inertia[2];
    const float yy = inertia[3];
    const float yz = inertia[4];
    const float zz = inertia[5];
    bool finite = robot_is_finite_f32(mass);
    bool zero = true;
    int why = 0;
    for (uint32_t i = 0U; i < 3U; i++) {
        finite = robot_is_finite_f32(com[i]) && finite;
    }
    for (uint32_t i = 0U; i < 6U; i++) {
        finite = robot_is_finite_f32(inertia[i]) && finite;
        zero = (inertia[i] >= 0.0F) && (inertia[i] <= 0.0F) && zero;
    }
    if (!finite) {
        why = 1;
    } else if (mass < 0.0F) {
        why = 2;
    } else if ((mass <= 0.0F) && (!zero)) {
        why = 3;
    } else {
        /* the second moment tr(J)/2 - J has no negative eigenvalue */
        const float half = 0.5F * ((xx + yy) + zz);
        const float slack = 1.9073486e-6F * half;
        const float a = (half - xx) + slack;
        const float b = (half - yy) + slack;
        const float c = (half - zz) + slack;
        const float d = -xy;
        const float e = -xz;
        const float f = -yz;
        const float ab = (a * b) - (d * d);
        const float ac = (a * c) - (e * e);
        const float bc = (b * c) - (f * f);
        const float determinant = ((a * bc) - (d * ((d * c) - (f * e)))) + (e * ((d * f) - (b * e)));
        const bool diagonal = (a >= 0.0F) && (b >= 0.0F) && (c >= 0.0F);
        const bool minors = (ab >= 0.0F) && (ac >= 0.0F) && (bc >= 0.0F);
        const bool possible = diagonal && minors && (determinant >= (((-slack) * half) * half));
        if (!possible) {
            why = 4;
        }
    }
    return why;
}

/*== arithmetic_check_f32 */
/* A product that is not exact, and a sum: of numbers that no compiler knows, as others are computed. */
static int robot_arithmetic_check_f32(void)
{
    volatile float read = 4097.0F;
    float factor;
    float product;
    float least;
    factor = read;
    read = 16785408.0F; /* factor * factor, rounded */
    product = read;
    read = 8.940697e-8F; /* three quarters of the distance from 1 to the next number */
    least = read;
    const float lost = (factor * factor) - product;
    const float more = (1.0F + least) - 1.0F;
    const bool is_rounded = (lost >= 0.0F) && (lost <= 0.0F) && (more > least);
    return is_rounded ? 0 : 1;
}
