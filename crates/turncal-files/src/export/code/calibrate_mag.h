static inline void turncal_calibrate_mag(const double raw[3], double field[3])
{
    double mag[3];
    for (int i = 0; i < 3; i++) {
        mag[i] = raw[i] - turncal_mag_bias[i];
    }
    for (int i = 0; i < 3; i++) {
        field[i] = 0.0;
        for (int j = 0; j < 3; j++) {
            field[i] += turncal_mag_correction[i][j] * mag[j];
        }
    }
}
