static inline double turncal_of_t(const double c[6], double d)
{
    return c[0] + d * (c[1] + d * (c[2] + d * (c[3] + d * (c[4] + d * c[5]))));
}

static inline void turncal_triad_at(const double scale[3][6], const double installation[9][6],
                                    const double bias[3][6], double d, const double *raw, double *calibrated)
{
    double a[3][3], n[3];
    for (int i = 0; i < 3; i++) {
        double k = turncal_of_t(scale[i], d), squares = 0.0;
        for (int j = 0; j < 3; j++) {
            a[i][j] = turncal_of_t(installation[3 * i + j], d);
            squares += i == j ? 0.0 : a[i][j] * a[i][j];
        }
        a[i][i] = sqrt(1.0 - squares);
        for (int j = 0; j < 3; j++)
            a[i][j] *= k;
        n[i] = raw[i] - turncal_of_t(bias[i], d);
    }
    double c[3][3], determinant = 0.0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int p = (i + 1) % 3, q = (i + 2) % 3, r = (j + 1) % 3, s = (j + 2) % 3;
            c[j][i] = a[p][r] * a[q][s] - a[p][s] * a[q][r];
        }
    for (int j = 0; j < 3; j++)
        determinant += a[0][j] * c[j][0];
    for (int i = 0; i < 3; i++)
        calibrated[i] = (c[i][0] * n[0] + c[i][1] * n[1] + c[i][2] * n[2]) / determinant;
}

static inline void turncal_calibrate_at(const double raw[6], double temperature_degc, double calibrated[6])
{
    double copy[6];
    for (int i = 0; i < 6; i++)
        copy[i] = raw[i];
    turncal_triad_at(turncal_gyro_scale_of_t, turncal_gyro_installation_of_t, turncal_gyro_bias_of_t,
                     temperature_degc - turncal_gyro_reference_degc, copy, calibrated);
    turncal_triad_at(turncal_accel_scale_of_t, turncal_accel_installation_of_t, turncal_accel_bias_of_t,
                     temperature_degc - turncal_accel_reference_degc, copy + 3, calibrated + 3);
}
