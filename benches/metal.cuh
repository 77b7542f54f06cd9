// What naga's Metal needs of its standard library, in CUDA: enough to compile the kernels and to count what they have.
// benches/metal_as_cuda.py puts it before a translated module.
typedef unsigned int uint;
#define device
#define thread
#define threadgroup
#define constant const
#define HERE __device__ __forceinline__
namespace metal {
using uint = unsigned int;
struct bool2 { bool x, y; };
struct uint3 { uint x, y, z; };
struct float3 {
    float x, y, z;
    float3() = default;
    HERE constexpr float3(float a, float b, float c) : x(a), y(b), z(c) {}
};
#define VECTOR2(V, T, N) \
    struct __align__(8) V { \
        T x, y; \
        V() = default; \
        HERE constexpr V(T s) : x(s), y(s) {} \
        HERE constexpr V(T a, T b) : x(a), y(b) {} \
        HERE T& operator[](uint i) { return (&x)[i]; } \
        HERE const T& operator[](uint i) const { return (&x)[i]; } \
    };
VECTOR2(float2, float, 2)
VECTOR2(uint2, uint, 2)
VECTOR2(int2, int, 2)
#define VECTOR4(V, T, V2) \
    struct __align__(16) V { \
        T x, y, z, w; \
        V() = default; \
        HERE constexpr V(T s) : x(s), y(s), z(s), w(s) {} \
        HERE constexpr V(T a, T b, T c, T d) : x(a), y(b), z(c), w(d) {} \
        HERE constexpr V(V2 a, V2 b) : x(a.x), y(a.y), z(b.x), w(b.y) {} \
        HERE T& operator[](uint i) { return (&x)[i]; } \
        HERE const T& operator[](uint i) const { return (&x)[i]; } \
    };
VECTOR4(float4, float, float2)
VECTOR4(uint4, uint, uint2)
struct packed_uint3 {
    uint x, y, z;
    packed_uint3() = default;
    HERE packed_uint3(uint3 v) : x(v.x), y(v.y), z(v.z) {}
    HERE uint operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};
#define OPERATOR2(V, T, op) \
    HERE V operator op(V a, V b) { return V(a.x op b.x, a.y op b.y); } \
    HERE V operator op(V a, T b) { return V(a.x op b, a.y op b); } \
    HERE V operator op(T a, V b) { return V(a op b.x, a op b.y); }
#define OPERATOR4(V, T, op) \
    HERE V operator op(V a, V b) { return V(a.x op b.x, a.y op b.y, a.z op b.z, a.w op b.w); } \
    HERE V operator op(V a, T b) { return V(a.x op b, a.y op b, a.z op b, a.w op b); } \
    HERE V operator op(T a, V b) { return V(a op b.x, a op b.y, a op b.z, a op b.w); }
OPERATOR2(float2, float, +) OPERATOR2(float2, float, -) OPERATOR2(float2, float, *) OPERATOR2(float2, float, /)
OPERATOR2(uint2, uint, +) OPERATOR2(uint2, uint, -) OPERATOR2(uint2, uint, *)
OPERATOR4(float4, float, +) OPERATOR4(float4, float, -) OPERATOR4(float4, float, *)
OPERATOR4(uint4, uint, +) OPERATOR4(uint4, uint, *) OPERATOR4(uint4, uint, ^) OPERATOR4(uint4, uint, >>)
HERE float2 operator-(float2 a) { return float2(-a.x, -a.y); }
HERE float2& operator+=(float2& a, float2 b) { return a = a + b; }
HERE float4& operator+=(float4& a, float4 b) { return a = a + b; }
HERE uint2& operator-=(uint2& a, uint2 b) { return a = a - b; }
HERE bool2 operator==(uint2 a, uint2 b) { return bool2{a.x == b.x, a.y == b.y}; }
HERE bool2 operator!=(float2 a, float2 b) { return bool2{a.x != b.x, a.y != b.y}; }
HERE bool2 operator<(float2 a, float2 b) { return bool2{a.x < b.x, a.y < b.y}; }
HERE bool2 operator<=(float2 a, float2 b) { return bool2{a.x <= b.x, a.y <= b.y}; }
HERE bool all(bool2 v) { return v.x && v.y; }
HERE bool any(bool2 v) { return v.x || v.y; }
HERE float abs(float a) { return fabsf(a); }
HERE int abs(int a) { return a < 0 ? -a : a; }
HERE float2 abs(float2 a) { return float2(fabsf(a.x), fabsf(a.y)); }
HERE float min(float a, float b) { return fminf(a, b); }
HERE float max(float a, float b) { return fmaxf(a, b); }
HERE uint min(uint a, uint b) { return a < b ? a : b; }
HERE uint max(uint a, uint b) { return a < b ? b : a; }
HERE int min(int a, int b) { return a < b ? a : b; }
HERE int max(int a, int b) { return a < b ? b : a; }
HERE float2 min(float2 a, float2 b) { return float2(fminf(a.x, b.x), fminf(a.y, b.y)); }
HERE float2 max(float2 a, float2 b) { return float2(fmaxf(a.x, b.x), fmaxf(a.y, b.y)); }
HERE float clamp(float a, float l, float h) { return fminf(fmaxf(a, l), h); }
HERE uint clamp(uint a, uint l, uint h) { return min(max(a, l), h); }
HERE int clamp(int a, int l, int h) { return min(max(a, l), h); }
HERE float2 clamp(float2 a, float2 l, float2 h) { return min(max(a, l), h); }
HERE float rint(float a) { return rintf(a); }
HERE float2 rint(float2 a) { return float2(rintf(a.x), rintf(a.y)); }
HERE float floor(float a) { return floorf(a); }
HERE float trunc(float a) { return truncf(a); }
HERE float sqrt(float a) { return sqrtf(a); }
HERE float exp(float a) { return expf(a); }
HERE float tanh(float a) { return tanhf(a); }
HERE float fma(float a, float b, float c) { return fmaf(a, b, c); }
HERE float sign(float a) { return a < 0 ? -1.0f : 0 < a ? 1.0f : 0.0f; }
HERE float dot(float2 a, float2 b) { return a.x * b.x + a.y * b.y; }
HERE float length(float2 a) { return sqrtf(dot(a, a)); }
HERE float distance(float2 a, float2 b) { return length(a - b); }
HERE float2 normalize(float2 a) { return a * rsqrtf(dot(a, a)); }
HERE float4 min(float4 a, float4 b) { return float4(fminf(a.x, b.x), fminf(a.y, b.y), fminf(a.z, b.z), fminf(a.w, b.w)); }
HERE float4 max(float4 a, float4 b) { return float4(fmaxf(a.x, b.x), fmaxf(a.y, b.y), fmaxf(a.z, b.z), fmaxf(a.w, b.w)); }
HERE float4 clamp(float4 a, float4 l, float4 h) { return min(max(a, l), h); }
HERE float4 tanh(float4 a) { return float4(tanhf(a.x), tanhf(a.y), tanhf(a.z), tanhf(a.w)); }
HERE float4 fma(float4 a, float4 b, float4 c) {
    return float4(fmaf(a.x, b.x, c.x), fmaf(a.y, b.y, c.y), fmaf(a.z, b.z, c.z), fmaf(a.w, b.w, c.w));
}
HERE uint clz(uint a) { return __clz(a); }
HERE uint popcount(uint a) { return __popc(a); }
template <typename T> HERE T select(T a, T b, bool c) { return c ? b : a; }
HERE float2 select(float2 a, float2 b, bool2 c) { return float2(c.x ? b.x : a.x, c.y ? b.y : a.y); }
HERE uint select(int a, uint b, bool c) { return c ? b : (uint)a; }
HERE int extract_bits(int v, uint o, uint n) { return (v << (32 - o - n)) >> (32 - n); }
HERE uint extract_bits(uint v, uint o, uint n) { return (v << (32 - o - n)) >> (32 - n); }
typedef uint atomic_uint;
typedef int atomic_int;
enum mem_flags { mem_threadgroup, mem_device };
enum { memory_order_relaxed };
HERE uint atomic_fetch_add_explicit(uint* p, uint v, int) { return atomicAdd(p, v); }
HERE int atomic_fetch_add_explicit(int* p, int v, int) { return atomicAdd(p, v); }
HERE int atomic_fetch_min_explicit(int* p, int v, int) { return atomicMin(p, v); }
HERE uint atomic_fetch_min_explicit(uint* p, uint v, int) { return atomicMin(p, v); }
HERE uint atomic_exchange_explicit(uint* p, uint v, int) { return atomicExch(p, v); }
HERE int atomic_exchange_explicit(int* p, int v, int) { return atomicExch(p, v); }
HERE int atomic_load_explicit(int* p, int) { return *(volatile int*)p; }
HERE uint atomic_load_explicit(uint* p, int) { return *(volatile uint*)p; }
HERE void atomic_store_explicit(int* p, int v, int) { *(volatile int*)p = v; }
HERE void atomic_store_explicit(uint* p, uint v, int) { *(volatile uint*)p = v; }
HERE void threadgroup_barrier(mem_flags) { __syncthreads(); }
HERE float simd_shuffle(float v, uint l) { return __shfl_sync(0xffffffffu, v, l); }
HERE uint simd_shuffle(uint v, uint l) { return __shfl_sync(0xffffffffu, v, l); }
}
template <typename R, typename T> HERE R as_type(T v) { R r; memcpy(&r, &v, sizeof r); return r; }
