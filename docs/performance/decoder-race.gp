set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'decoder-race.png'
set datafile separator comma
set title 'Decoder of model `race`'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top right
set xlabel ''
set xtics ('ours_avx3_int16' 0, 'onednn_bf16' 1, 'ours_avx3' 2, 'onednn_fp32' 3, 'libtorch_bf16' 4, 'ours_avx2' 5, 'libtorch_fp32' 6, 'ours_sse4' 7, 'eigen_fp32' 8, 'ours_scalar' 9)
set ylabel '163,840 queries on one core [ms]'
set yrange [0:*]
set boxwidth 0.736
set style fill solid 0.85 noborder
plot 'decoder-race.csv' skip 1 every ::0::9 using ($2+0):3 with boxes lc rgb '#0072b2' notitle
