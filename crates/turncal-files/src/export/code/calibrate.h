static inline void turncal_calibrate(const double raw[6], double calibrated[6])
{
    double gyro[3], accel[3];
    for (int i = 0; i < 3; i++) {
        gyro[i] = raw[i] - turncal_gyro_bias[i];
        accel[i] = raw[3 + i] - turncal_accel_bias[i];
    }
    for (int i = 0; i < 3; i++) {
        calibrated[i] = 0.0;
        calibrated[3 + i] = 0.0;
        for (int j = 0; j < 3; j++) {
            calibrated[i] += turncal_gyro_correction[i][j] * gyro[j];
            calibrated[3 + i] += turncal_accel_correction[i][j] * accel[j];
        }
    }
}
