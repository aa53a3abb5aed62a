#include "lab/simd.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lab {
namespace HWY_NAMESPACE {
namespace {

std::int64_t target() {
    return HWY_TARGET;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace lab
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lab {
namespace {

HWY_EXPORT(target);

// In the words of the processors' makers; Highway calls AVX-512 AVX3.
std::string name_of(std::int64_t target) {
    std::string name = hwy::TargetName(target);
    if (name == "AVX3") return "avx512";
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    return name;
}

// Better sets have lower bits.
std::vector<std::int64_t> available() {
    hwy::DisableTargets(0);
    std::vector<std::int64_t> targets;
    for (std::int64_t left = hwy::SupportedTargets() & (HWY_TARGETS); left != 0; left &= left - 1)
        targets.push_back(left & -left);
    return targets;
}

// What Highway looks up is kept here: asking for the choices must not change the choice.
std::int64_t disabled = 0;

}  // namespace

std::vector<std::string> simd_choices() {
    std::vector<std::string> names;
    for (const std::int64_t t : available()) names.push_back(name_of(t));
    hwy::DisableTargets(disabled);
    return names;
}

std::string simd() {
    return name_of(HWY_DYNAMIC_DISPATCH(target)());
}

void set_simd(const std::string& name) {
    std::int64_t better = 0;
    for (const std::int64_t t : available()) {
        if (name_of(t) == name) {
            disabled = better;
            hwy::DisableTargets(disabled);
            return;
        }
        better |= t;
    }
    hwy::DisableTargets(disabled);
    std::string choices;
    for (const std::string& choice : simd_choices()) choices += (choices.empty() ? "" : ", ") + choice;
    throw std::invalid_argument("instruction set " + name + ": this machine and build have " + choices);
}

}  // namespace lab
#endif
