// The loops of device_loops.h for whatever registers an including file has: that defines `lanes`, the doubles of one
// register, includes lanes_body.h, defines any(marks), whether a bit is set, and joined(v, join), the two halves of v joined
// until one number is left, then includes this, all inside its own namespace.
//
// Comparisons are written so that what is not a number counts as no violation, and what stands behind an array as nothing.

inline double sum(const Lanes& v) noexcept {
    return joined(v, [](const auto& a, const auto& b) { return a + b; });
}
// The largest whole numbers not above v, |v| < 2^51.
inline Lanes whole_below(const Lanes& v) noexcept {
    const Lanes nearest = (v + nearest_shift) - nearest_shift;
    return nearest > v ? nearest - 1. : nearest;
}

bool senses_hold(const SpeedCheck& c) SHIFTRIG_REALTIME {
    Marks broken = {};
    for (int i = 0; i < c.speeds; i += lanes) broken |= read(c.sense + i) * read(c.end + i) < 0;
    return !any(broken);
}

bool may_dip(const SpeedCheck& c) SHIFTRIG_REALTIME {
    Marks close = {};
    for (int i = 0; i < c.speeds; i += lanes) {
        // The parabola through three margins: falling at first, rising at last.
        const Lanes sense = read(c.sense + i);
        const Lanes g0 = sense * read(c.begin + i), gm = sense * read(c.half + i),
                    g1 = sense * read(c.end + i);
        close |= (4. * gm - 3. * g0 - g1 < 0) & (g0 - 4. * gm + 3. * g1 > 0) & (g1 > 0);
    }
    return any(close);
}

bool pressed_engage(const double* sliding, const double* holding, const double* state_code,
                    int pairs) SHIFTRIG_REALTIME {
    Marks wrong = {};
    for (int k = 0; k < pairs; k += lanes) {
        const Marks pressed = (read(sliding + k) > 0) | (read(holding + k) > 0);
        wrong |= ~(pressed ^ (read(state_code + k) == 2.)) & first_of(pairs - k);
    }
    return !any(wrong);
}

bool some_turned(const MeshFlow& m, const double* told, double torque) SHIFTRIG_REALTIME {
    Marks turned = {};
    for (int k = 0; k < m.meshes; k += lanes) {
        turned |= (read(m.checked + k) != 0) & (read(told + k) != read(m.direction + k)) &
                  (magnitude(read(m.torque + k)) >= torque) & first_of(m.meshes - k);
    }
    return any(turned);
}

// math/elementary.h's, bit for bit, of what is not above 0.
inline Lanes exp_below(const Lanes& x) noexcept {
    const Lanes least = Lanes{} - 745.2, bounded = x < least ? least : x;
    const Lanes shifted = bounded * exp_inverse_ln2 + nearest_shift, k = shifted - nearest_shift;
    const Lanes e = exp_remainder(bounded, k);
    // In two factors, of which the first rounds nothing: the result may be subnormal.
    const Marks n = reinterpret_cast<Marks>(shifted) - reinterpret_cast<Marks>(Lanes{} + nearest_shift);
    const Marks half = n >> 1;
    const auto power_of_two = [](const Marks& exponent) {
        return reinterpret_cast<Lanes>((exponent + 1023) << 52);
    };
    return where(~(x < least), e * power_of_two(half) * power_of_two(n - half));
}

template <bool complete>
inline void slide_pairs(const FrictionTerms& t, double* f, double* holding, double* sliding) noexcept {
    const Lanes most = Lanes{} + t.drag_limit;
    for (int k = 0; k < t.pairs; k += lanes) {
        const Lanes slip = read(t.slip + k), load = read(t.load + k);
        Lanes factor = read(t.base + k);
        if (t.fades) factor += read(t.rise + k) * exp_below(-magnitude(slip) * read(t.inverse_speed + k));
        const Lanes passed = load * factor;
        const Lanes capped = slip > most ? most : slip;
        const Lanes drag = read(t.drag + k) * (capped < -most ? -most : capped);
        write(f + k, drag + read(t.sense + k) * passed);
        if (!complete) continue;
        write(sliding + k, passed);
        write(holding + k, load * read(t.static_factor + k));
    }
}
void slide(const FrictionTerms& t, double* f) SHIFTRIG_REALTIME {
    slide_pairs<false>(t, f, nullptr, nullptr);
}
void press(const FrictionTerms& t, double* f, double* holding, double* sliding) SHIFTRIG_REALTIME {
    slide_pairs<true>(t, f, holding, sliding);
}

Work3 book(const PowerTerms& t, double h, double* work) SHIFTRIG_REALTIME {
    const double sixth = h / 6;
    Lanes lost = {}, given = {};
    for (int k = 0; k < t.forces; k += lanes) {
        const Lanes part = sixth * (read(t.force[0] + k) * read(t.slip[0] + k) +
                                    4. * (read(t.force[1] + k) * read(t.slip[1] + k)) +
                                    read(t.force[2] + k) * read(t.slip[2] + k));
        write(work + k, read(work + k) + part);
        lost += where(read(t.lost + k) != 0, part);
        given -= where(read(t.given + k) != 0, part);
    }
    Lanes rest = {};
    for (int k = 0; k < t.meshes; k += lanes) {
        const Lanes share = read(t.loss_share + k);
        const Lanes power = read(t.mesh_torque[0] + k) * read(t.turning[0] + k) +
                            4. * (read(t.mesh_torque[1] + k) * read(t.turning[1] + k)) +
                            read(t.mesh_torque[2] + k) * read(t.turning[2] + k);
        rest += where(share != 0, share * power);
    }
    for (int i = 0; i < t.swings; i += lanes) {
        const Lanes damping = read(t.damping + i);
        const Lanes a = read(t.swing[0] + i), b = read(t.swing[1] + i), c = read(t.swing[2] + i);
        rest += where(damping != 0, damping * (a * a + 4. * (b * b) + c * c));
    }
    return {sum(lost) + sixth * sum(rest), sum(given)};
}

void subtract(const double* a, const double* b, int count, double* difference) SHIFTRIG_REALTIME {
    for (int i = 0; i < count; i += lanes) write(difference + i, read(a + i) - read(b + i));
}

// The largest magnitude among so many of value(i), i = 0, lanes, 2 lanes …; two at a time, since each waits for the one before.
template <typename Value>
inline double largest_of(int count, const Value& value) noexcept {
    const auto larger = [](const Lanes& a, const Lanes& b) { return a > b ? a : b; };
    Lanes most = {}, other = {};
    int i = 0;
    for (; i + 2 * lanes <= count; i += 2 * lanes) {
        most = larger(magnitude(value(i)), most);
        other = larger(magnitude(value(i + lanes)), other);
    }
    for (; i < count; i += lanes) most = larger(where(first_of(count - i), magnitude(value(i))), most);
    return joined(larger(other, most), [](const auto& a, const auto& b) { return b > a ? b : a; });
}

double largest(const double* v, int count) SHIFTRIG_REALTIME {
    return largest_of(count, [=](int i) { return read(v + i); });
}

double largest_difference(const double* a, const double* b, int count) SHIFTRIG_REALTIME {
    return largest_of(count, [=](int i) { return read(a + i) - read(b + i); });
}

inline double square(const double* v, int count) noexcept {
    Lanes sums = {};
    for (; count > 0; count -= lanes, v += lanes) {
        const Lanes value = where(first_of(count), read(v));
        sums += value * value;
    }
    return sum(sums);
}

double share_of_squares(const double* rest, int rests, const double* v, int count) SHIFTRIG_REALTIME {
    const double all = square(v, count);
    return all > 0 ? square(rest, rests) / all : 0;
}

double weighted_square(const double* weight, const double* v, int count) SHIFTRIG_REALTIME {
    Lanes sums[2] = {};
    for (; count > 2 * lanes; count -= 2 * lanes, weight += 2 * lanes, v += 2 * lanes) {
        for (int i = 0; i < 2; ++i) {
            const Lanes value = read(v + i * lanes);
            sums[i] += read(weight + i * lanes) * value * value;
        }
    }
    for (int i = 0; i < 2 && count > i * lanes; ++i) {
        const Lanes value = where(first_of(count - i * lanes), read(v + i * lanes));
        sums[i] += read(weight + i * lanes) * value * value;
    }
    return sum(sums[0] + sums[1]);
}

bool same(const double* a, const double* b, int count) SHIFTRIG_REALTIME {
    Marks different = {};
    for (; count >= lanes; count -= lanes, a += lanes, b += lanes)
        different |= reinterpret_cast<Marks>(read(a)) ^ reinterpret_cast<Marks>(read(b));
    std::int64_t last = 0;  // these may be the end of their memory
    for (int i = 0; i < count; ++i)
        last |= __builtin_bit_cast(std::int64_t, a[i]) ^ __builtin_bit_cast(std::int64_t, b[i]);
    return !any(different) && last == 0;
}

void copy(const double* from, int count, double* to) SHIFTRIG_REALTIME {
    for (; count >= lanes; count -= lanes, from += lanes, to += lanes) write(to, read(from));
    for (int i = 0; i < count; ++i) to[i] = from[i];
}

bool heat(const HeatTerms& t, const double* work, double rate, double oil, double* surface, double* bulk,
          double* before) SHIFTRIG_REALTIME {
    Marks passed = {};
    for (int k = 0; k < t.count; k += lanes) {
        const Lanes old = read(surface + k), s = old - oil, b = read(bulk + k) - oil;
        const Lanes p = gather(work, t.pair + k) * rate;
        const Lanes now = oil + read(t.e11 + k) * s + read(t.e12 + k) * b + read(t.f1 + k) * p;
        write(bulk + k, oil + read(t.e21 + k) * s + read(t.e22 + k) * b + read(t.f2 + k) * p);
        write(surface + k, now);
        write(before + k, old);
        const Lanes warn = read(t.warn + k), fail = read(t.fail + k);
        passed |= ((old < warn) & (now >= warn)) | ((old < fail) & (now >= fail));
    }
    return any(passed);
}

void pick_up(const PickupTerms& t, const double* begin, const double* end, double h, double* position,
             double* since_edge, double* reading) SHIFTRIG_REALTIME {
    for (int i = 0; i < t.count; i += lanes) {
        const Lanes teeth = read(t.teeth + i), pitch = read(t.pitch + i),
                    last_speed = gather(end, t.mass + i);
        const Lanes travel = 0.5 * (gather(begin, t.mass + i) + last_speed) * h / pitch;  // [teeth]
        const Lanes from = read(position + i), to = from + travel;
        // Backwards, the same with both ends turned round.
        const Marks backward = travel < 0;
        const Lanes first = whole_below(backward ? -from : from) + 1.;
        const Lanes last = whole_below(backward ? -to : to);
        const Lanes count = last - first + 1.;
        const Lanes last_time = h * ((last - (backward ? -from : from)) / magnitude(travel));
        const Lanes since = read(since_edge + i), old = read(reading + i), waited = since + h;
        const Lanes measured = count * pitch / (since + last_time);
        const Marks turned = backward & (read(t.directional + i) != 0), seen = count > 0, ideal = teeth == 0;
        Lanes value = turned ? -measured : measured;
        if (any(~seen & ~ideal)) {
            const Lanes limit = pitch / waited,
                        faded = magnitude(old) > limit ? (old < 0 ? -limit : limit) : old;
            value = seen ? value : faded;
        }
        const Lanes shown = magnitude(value) < read(t.drop_out_speed + i) ? Lanes{} : value;
        const Marks inside = (to >= 0) & (to < teeth);
        Lanes place = to;
        if (any(~inside & ~ideal)) place = inside ? to : to - teeth * whole_below(to / teeth);
        write(reading + i, ideal ? last_speed : shown);
        write(since_edge + i, ideal ? since : seen ? h - last_time : waited);
        write(position + i, ideal ? from : place);
    }
}

double* show_clutches(const ClutchValues& c, double* next) SHIFTRIG_REALTIME {
    double *const torque = next, *const slip = torque + c.count, *const capacity = slip + c.count,
                  *const state = capacity + c.count, *const power = state + c.count,
                  *const heat = power + c.count;
    // In this order: what is written behind the last of one is the beginning of the next.
    for (int k = 0; k < c.count; k += lanes) write(torque + k, read(c.force + k) + read(c.torque + k));
    for (int k = 0; k < c.count; k += lanes) write(slip + k, read(c.slip + k));
    for (int k = 0; k < c.count; k += lanes) write(capacity + k, read(c.capacity + k));
    for (int k = 0; k < c.count; k += lanes) write(state + k, read(c.state_code + k));
    for (int k = 0; k < c.count; k += lanes) write(power + k, read(c.force + k) * read(c.slip + k));
    for (int k = 0; k < c.count; k += lanes) write(heat + k, read(c.heat + k));
    return heat + c.count;
}

double* show_shafts(const ShaftValues& s, double* next) SHIFTRIG_REALTIME {
    double* const twist = next + s.count;
    for (int e = 0; e < s.count; e += lanes)
        write(next + e, read(s.stiffness + e) * read(s.twist + e) + read(s.damping + e) * read(s.rate + e));
    for (int e = 0; e < s.count; e += lanes) write(twist + e, read(s.twist + e));
    return twist + s.count;
}

constexpr DeviceLoops device_loops{
    senses_hold, may_dip, pressed_engage,     some_turned,      slide,           press, book,
    subtract,    largest, largest_difference, share_of_squares, weighted_square, same,  copy,
    heat,        pick_up, show_clutches,      show_shafts};
