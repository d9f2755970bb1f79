/** Tables of ISO/IEC 14496-2, from tools/web/make_tables.py: digits in base 36. */

/** Groups of FAPs 1 to 68 and of BAPs 1 to 296, from 0. */
export const FAP_GROUPS = "00111111111111111122222222222233333333444455555666777777777788889999";
export const BAP_GROUPS = "00012123412341234343434787878785656565678567878999dddaaabbb999cccbbbcccaaacccdddbbbddd999cccbbbdddaaacccbbbaaaccc999bbbaaaghefghghefefghefghghefefghefghghefefghefghghefefefefghefefiiiiiijjjjjjjjjjjjjjjjjjjjjjkkkkkkkkkkkkkkkkkkkkkkllllllllllllllllllllllmmmmmmmmmmmmmmmmmmmmmmnnnnnnnnnnnnnnnnnnnnnn";
const FACE_STEPS = "0010101322222222221111111115555111122222211222211118666222222222211111111000";
const ISO_STEPS = "444555577557755777777775555555544447744775555775557775557775557777777775557777777777775557777777775557777775557775557775558855557755557755557755557755557755557755557755555555775555444444";
/** Quantiser steps; of a select, which has none, 0. */
export const STEPS = [0, 1, 2, 4, 64, 128, 170, 256, 512];
/** The steps of all slots, up to that of BAP 186, as places in the list above; else 1. */
export const STEP_PLACES = {
  iso: FACE_STEPS + ISO_STEPS,
  visage: FACE_STEPS + ISO_STEPS.slice(0, -6).replace(/[45]/g, "6") + "222666",
};
const I_FACE = "0000000iavaaaavvaaaiii7iiaakkffaa77ffffffffffaaiiiiivvvavaaaavvaa99cfffff000";
const P_BOTH = "000000063a3333aa3336663aa447755332266666655553377777aaa3a3333aa3322334455000aaaaaaa66aa66aa66aa22aa22112222aaaa66aa66aa6666aaa2226662226662222222226662222222222226662222222226662222226662226662226662244222244442244222244442244222244441144112244444444444444aaaaaa";
/** Default limits of all slots up to BAP 186, in units of 60: I max, I min, P max, P min. */
export const LIMITS = [
  I_FACE + "gggll88gg33ggddggdd33dd41226166vvv4ggqqggggbbbbvvv444bbb444bbb444444444bbb444444444444bbb444444444bbb444444bbb444bbb444bbb444427631111336624441111226633331111116642341111g8i2221111vvvvvv",
  I_FACE + "gggllggggppggddggdd33dd14221666ii4vgg11ggggbbbbvvv444bbb444bbb444444444bbb444444444444bbb444444444bbb444444bbb444bbb444bbb44jj7236nngg33jj4244nngg22jj3333nngg11jj2443nngg8g2iccddggvvvvvv",
  P_BOTH,
  P_BOTH,
];
