// Loops over whole matrices, for building operators (kernels.h says what they do): included as device_loops_body.h is.

template <int terms>
inline void combine_terms(const Term* term, int count, double* sum) noexcept {
    int i = 0;
    for (; i + lanes <= count; i += lanes) {
        Lanes total = term[0].factor * read(term[0].of + i);
        if constexpr (terms > 1) total += term[1].factor * read(term[1].of + i);
        if constexpr (terms > 2) total += term[2].factor * read(term[2].of + i);
        if constexpr (terms > 3) total += term[3].factor * read(term[3].of + i);
        write(sum + i, total);
    }
    for (; i < count; ++i) {
        double total = term[0].factor * term[0].of[i];
        for (int k = 1; k < terms; ++k) total += term[k].factor * term[k].of[i];
        sum[i] = total;
    }
}

void combine(const Term* term, int terms, int count, double* sum) SHIFTRIG_REALTIME {
    switch (terms) {
        case 1:
            return combine_terms<1>(term, count, sum);
        case 2:
            return combine_terms<2>(term, count, sum);
        case 3:
            return combine_terms<3>(term, count, sum);
        default:
            return combine_terms<4>(term, count, sum);
    }
}

// So many rows from `first` on, which lie side by side in one panel.
template <int rows>
inline void place_rows(const Placing& p, int first, const double* source, double factor,
                       double* panels) noexcept {
    const int row = p.top + first;
    const int height = p.rows - row / panel_rows * panel_rows < panel_rows ? 4 : panel_rows;
    double* at = panels + panel_index(p.rows, p.width, row, p.first_column);
    const double* from = source + first;
    double scale[rows];
    for (int i = 0; i < rows; ++i) scale[i] = factor * p.row_scale[first + i];
    for (int c = 0; c < p.columns; ++c, at += height, from += p.block_rows) {
        const double of_column = p.column_scale ? p.column_scale[c] : 1;
        double values[rows];
        for (int i = 0; i < rows; ++i) values[i] = from[i] * scale[i] * of_column;
        for (int i = 0; i < rows; ++i) at[i] = values[i];
    }
}

void place(const Placing& p, const double* source, double factor, double* panels) SHIFTRIG_REALTIME {
    for (int first = 0; first < p.block_rows;) {  // blocks are whole fours
        if ((p.top + first) % panel_rows == 0 && first + panel_rows <= p.block_rows) {
            place_rows<panel_rows>(p, first, source, factor, panels);
            first += panel_rows;
        } else {
            place_rows<4>(p, first, source, factor, panels);
            first += 4;
        }
    }
}

void sweep(const Sweep& s, const double* from, const double* start, double* to) SHIFTRIG_REALTIME {
    constexpr int registers = stripe_width / lanes;
    for (int k = 0; k < s.count; ++k) {
        const int row = s.order[k];
        Lanes sum[registers] = {};
        const int end = s.row_begin[row + 1];
        for (int e = s.row_begin[row]; e < end; ++e) {
            const double* const x = from + s.column[e] * stripe_width;
            for (int i = 0; i < registers; ++i) sum[i] += s.value[e] * read(x + i * lanes);
        }
        const double* const first = start + row * stripe_width;
        double* const y = to + row * stripe_width;
        for (int i = 0; i < registers; ++i)
            write(y + i * lanes, s.share * read(first + i * lanes) + s.factor * sum[i]);
    }
}
