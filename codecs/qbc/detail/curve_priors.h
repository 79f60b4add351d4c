// What recordings teach about the numbers of a qbc stream before any is seen (codecs/qbc/detail/curve_code.h): coefficients of
// the predictions, and probabilities in 1/65536 that adaptive models start from. Part of the format: a change is a
// new one. Private to this folder.
#pragma once

#include <array>
#include <cstdint>

namespace kinespace::curve_priors {

// Of the end of a segment: along the slope at its start, and towards the next common break, more so when that is near.
inline constexpr double onwards = 0.294;
inline constexpr double towards = 0.519;
inline constexpr double towards_last = 0.493;
inline constexpr double first_towards = 0.671;
// Of a common break: back to the one before the last.
inline constexpr double back = 0.2;
// Of its middle: how much of the way from the chord's to that which goes on smoothly.
inline constexpr double smooth = 0.305;

// [kind][size]
inline constexpr std::array<std::array<std::uint16_t, 8>, 3> nonzero{
    {{59781, 38571, 45971, 53243, 58457, 61884, 63402, 64500},
     {28563, 33786, 47633, 53833, 57786, 60045, 61434, 62876},
     {24403, 31899, 45595, 52476, 56799, 60035, 61955, 61240}}};
// That a magnitude needs another binary digit: [kind][size][digits]
inline constexpr std::array<std::array<std::array<std::uint16_t, 6>, 8>, 3> more{
    {{{{58374, 57339, 51876, 46676, 40539, 27176},
       {26550, 24019, 25222, 31391, 18883, 6898},
       {34908, 25696, 23920, 16966, 23315, 16049},
       {45442, 35108, 23372, 16527, 14112, 22986},
       {54246, 44589, 32793, 21886, 15881, 14779},
       {58858, 54280, 44493, 32642, 20896, 12239},
       {62269, 59082, 54520, 44276, 32846, 17677},
       {63507, 62551, 60123, 55781, 47198, 29923}}},
     {{{35527, 35333, 30227, 27448, 16341, 7214},
       {25777, 16234, 9758, 5942, 6199, 14563},
       {33480, 19431, 8577, 5775, 5924, 3855},
       {42542, 27126, 12772, 5767, 4640, 11128},
       {50487, 38314, 21992, 10255, 5190, 6561},
       {55673, 47907, 34908, 19448, 10062, 6991},
       {58279, 53828, 45879, 32941, 19166, 8544},
       {60585, 56839, 53646, 44341, 34962, 19371}}},
     {{{28312, 25107, 18247, 15043, 5154, 14563},
       {21575, 9443, 5335, 8235, 29424, 23130},
       {28302, 12158, 6693, 6840, 15738, 16199},
       {38199, 19847, 8729, 6568, 8954, 17455},
       {47556, 32572, 16129, 8591, 7249, 6199},
       {54016, 44713, 29757, 17692, 9292, 12702},
       {57406, 51858, 43253, 32964, 21228, 13063},
       {60274, 55904, 50349, 43587, 35915, 23450}}}}};

// That the binary digit behind the first is a 1: [digits behind the first]
inline constexpr std::array<std::uint16_t, 5> second{32768, 28300, 25500, 21300, 18000};

// That a segment is the last of its interval: [how many are before it][binary digits of the places left]
inline constexpr std::array<std::array<std::uint16_t, 12>, 3> last{
    {{32768, 32768, 64325, 40321, 6459, 17916, 1500, 1500, 1500, 1500, 1500, 1500},
     {32768, 62175, 35410, 29991, 36866, 7788, 1500, 1500, 1500, 1500, 1500, 1500},
     {32768, 35955, 24458, 15530, 6936, 1500, 1500, 1500, 1500, 1500, 1500, 1500}}};
// That a length needs another binary digit: [digits]
inline constexpr std::array<std::uint16_t, 12> longer{35393, 32786, 24189, 10590, 1826, 1500,
                                                      2000,  2000,  2000,  2000,  2000, 2000};

}  // namespace kinespace::curve_priors
