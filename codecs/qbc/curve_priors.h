// What recordings teach about the numbers of a qbc stream before any is seen (codecs/qbc/curve_code.h): coefficients of
// the predictions, and probabilities in 1/65536 that adaptive models start from. Part of the format: a change is a
// new one. Private to this folder.
#pragma once

#include <array>
#include <cstdint>

namespace kinespace::curve_priors {

// Of the end of a segment: along the slope at its start, and towards the next common break.
inline constexpr double onwards = 0.373;
inline constexpr double towards = 0.511;
inline constexpr double first_towards = 0.426;
// Of its middle: how much of the way from the chord's to that which goes on smoothly.
inline constexpr double smooth = 0.296;

// [kind][size]
inline constexpr std::array<std::array<std::uint16_t, 6>, 3> nonzero{{{57962, 33905, 46845, 54462, 59816, 63838},
                                                                      {42565, 33424, 47506, 52909, 56764, 59488},
                                                                      {36339, 31693, 43024, 51012, 55625, 59085}}};
// That a magnitude needs another binary digit: [kind][size][digits]
inline constexpr std::array<std::array<std::array<std::uint16_t, 6>, 6>, 3> more{
    {{{{58682, 57409, 51646, 46086, 40352, 26353},
       {24402, 27336, 23066, 28258, 16049, 24144},
       {34919, 25058, 22857, 15299, 23877, 13329},
       {45505, 35038, 23673, 17585, 13411, 18095},
       {53656, 45680, 33293, 22347, 15559, 13528},
       {61111, 58996, 53955, 46235, 38235, 26346}}},
     {{{41455, 34741, 29999, 23529, 18158, 13227},
       {27964, 20371, 13978, 16373, 13141, 8836},
       {34319, 23194, 15960, 12322, 11014, 12937},
       {40912, 28924, 18266, 12742, 11138, 11962},
       {48140, 38190, 25240, 15943, 11495, 9398},
       {53964, 49440, 40585, 29831, 20928, 15927}}},
     {{{33127, 27031, 16767, 14791, 1771, 32768},
       {23176, 17781, 11347, 10005, 17597, 13227},
       {28575, 19306, 12302, 10339, 10816, 19450},
       {36154, 25495, 14855, 11538, 12469, 15395},
       {45031, 34839, 21473, 13301, 11557, 14538},
       {51838, 48052, 39518, 29386, 22032, 18351}}}}};

// That a segment is the last of its interval: [how many are before it][binary digits of the places left]
inline constexpr std::array<std::array<std::uint16_t, 12>, 3> last{
    {{32768, 32768, 32768, 55950, 22088, 6459, 12277, 1500, 1500, 1500, 1500, 1500},
     {32768, 56173, 56173, 36253, 20832, 37496, 7198, 1500, 1500, 1500, 1500, 1500},
     {32768, 31788, 22442, 13472, 8529, 3476, 1500, 1500, 1500, 1500, 1500, 1500}}};
// That a length needs another binary digit: [digits]
inline constexpr std::array<std::uint16_t, 12> longer{34943, 35934, 31820, 20157, 9559, 1500,
                                                      2000,  2000,  2000,  2000,  2000, 2000};

}  // namespace kinespace::curve_priors
